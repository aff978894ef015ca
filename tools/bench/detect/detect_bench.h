#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/simworld/detect_scene.h"

namespace mocap::bench {

/// Centroid precision of blobs within one range of radii.
struct DetectRadiusFigures {
  double radius_px = 0.0;        ///< lower end of the range, which is 1 px wide
  int blobs = 0;                 ///< number of scored blobs
  double centroid_rms_px = 0.0;  ///< error per axis against the truth
  double crlb_px = 0.0;          ///< Cramer-Rao bound of the same discs
  double sigma_px = 0.0;         ///< root mean square of the sigma_px that the detector reports
};

struct DetectBenchFigures {
  double median_us = 0.0;          ///< time for an image that is not in the cache
  double read_us = 0.0;            ///< plain read of such an image
  double opencv_us = 0.0;          ///< threshold, contours, moments
  double ratio_read = 0.0;         ///< median_us / read_us
  double speedup_opencv = 0.0;     ///< opencv_us / median_us
  double white_noise_us = 0.0;     ///< time for an image of white noise, at the worst threshold
  double ratio_white_noise = 0.0;  ///< white_noise_us / time for a dark image with markers
  DetectRadiusFigures all;
  std::vector<DetectRadiusFigures> by_radius;
  double recall = 0.0;  ///< share of the markers that are found within half a radius
  double false_per_frame = 0.0;
  std::string isa;
};

/// Measures the detection in images in memory, with one thread.
Result<DetectBenchFigures> run_detect_bench(const simworld::DetectSceneSettings& settings);

}  // namespace mocap::bench
