#pragma once

#include <memory>
#include <optional>
#include <span>

#include "base/result.h"
#include "model/frame.h"
#include "model/image_mask.h"
#include "module/detector.h"

namespace mocap::detect {

/// Grey levels are those of 8 bits, 0 to 255, whatever the format; deeper formats scale them.
struct DetectSettings {
  std::optional<double> threshold =
      std::nullopt;  ///< a marker's pixels are this bright or brighter, 1 to 255; empty: from noise
  std::optional<double> low_threshold =
      std::nullopt;              ///< taken off each pixel before it weighs, 0 to threshold; empty: from noise
  double min_area_px2 = 4.0;     ///< of pixels over the threshold; smaller is noise; at least 1
  double max_area_px2 = 5000.0;  ///< larger is a window or a lamp
  double min_roundness = 0.3;    ///< 0 to 1; less is a cable or an edge
  double min_peak_grey = 0.0;    ///< of the brightest pixel; less is a reflection, 0 to 255
  bool split_touching = true;    ///< a blob with a waist is two markers
  int grow_px = 2;               ///< how far light outside of the threshold still counts, 0 to 8
};

struct DetectKernels;

/// Makes the detector for images of one format and size.
///
/// Bright pixels that touch (8-connected) are a component, less what is masked. Its centroid is weighted by intensity
/// from the low threshold to its own plateau, over its box grown by `grow_px`, less what is a neighbour's. Where
/// thresholds come from noise, background and noise are read from a few places of each image: the same image gives the
/// same blobs, on every processor. Blobs come in the order of their first pixel, row by row; a component with a waist
/// is two blobs. An image that is smaller than its size and stride say gives none.
///
/// `sigma_px` is the standard deviation that the image's noise gives the centroid, with a floor for the pixel grid; a
/// blob cut by the border or a mask, or parted from another, knows its place less well, which is added.
///
/// A row with bright pixels all over it, in more than three of four words of 64 pixels (and 4), and with more than a
/// run for every 40 pixels (and 32), is noise; so is what is left of a quarter of the image's height that has used up
/// its share of a run for every 160 pixels (and 8192). Such rows are given up and counted.
///
/// Formats: all but Mjpeg, which fails with Unsupported (cameras hand it on decoded). Fails with InvalidArgument for
/// sizes outside of 1 to 32767 and settings outside of their ranges. `kernels` are for tests and benches; the fastest
/// are taken where there are none.
Result<std::unique_ptr<Detector>> make_blob_detector(const DetectSettings& settings, PixelFormat format, int width_px,
                                                     int height_px, std::span<const MaskPolygon> masks = {},
                                                     const DetectKernels* kernels = nullptr);

}  // namespace mocap::detect
