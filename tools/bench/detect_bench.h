#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/simworld/detect_scene.h"

namespace mocap::bench {

/// How well blobs of about one radius were measured.
struct DetectRadiusFigures {
  double radius_px = 0.0;        ///< from here, a pixel wide
  int blobs = 0;                 ///< that were scored
  double centroid_rms_px = 0.0;  ///< per axis, against truth
  double crlb_px = 0.0;          ///< Cramer-Rao bound of the same discs
  double sigma_px = 0.0;         ///< as the detector predicts, root mean square
};

struct DetectBenchFigures {
  double median_us = 0.0;          ///< of an image that is not in the cache
  double read_us = 0.0;            ///< plain read of such an image
  double opencv_us = 0.0;          ///< threshold, contours, moments
  double ratio_read = 0.0;         ///< median_us / read_us
  double speedup_opencv = 0.0;     ///< opencv_us / median_us
  double white_noise_us = 0.0;     ///< an image of white noise, at the worst threshold
  double ratio_white_noise = 0.0;  ///< to a dark image with markers
  DetectRadiusFigures all;
  std::vector<DetectRadiusFigures> by_radius;
  double recall = 0.0;  ///< of the markers, found within half a radius
  double false_per_frame = 0.0;
  std::string isa;
};

/// Measures detection on images in memory, one thread.
Result<DetectBenchFigures> run_detect_bench(const simworld::DetectSceneSettings& settings);

}  // namespace mocap::bench
