#pragma once

#include <memory>
#include <optional>

#include "base/result.h"
#include "model/frame.h"
#include "module/detector.h"

namespace mocap::stages {

/// Grey levels are those of 8 bits, 0 to 255, whatever the format; deeper formats scale them.
struct DetectSettings {
  std::optional<double> threshold =
      std::nullopt;  ///< a marker's pixels are this bright or brighter, 1 to 255; empty: from noise
  std::optional<double> low_threshold =
      std::nullopt;              ///< taken off each pixel before it weighs, 0 to threshold; empty: from noise
  double min_area_px2 = 4.0;     ///< of pixels over the threshold; smaller is noise; at least 1
  double max_area_px2 = 5000.0;  ///< larger is a window or a lamp
  double min_roundness = 0.3;    ///< 0 to 1; less is a cable or an edge
  int grow_px = 2;               ///< how far light outside of the threshold still counts, 0 to 8
};

/// Makes the detector for images of one format and size.
///
/// Bright pixels that touch (8-connected) are a component; its centroid is weighted with intensity over the low
/// threshold, over the component grown by `grow_px`. Where thresholds come from noise, background and noise are read
/// from a sparse grid of each image; the same image gives the same blobs. Blobs come in the order of their first pixel,
/// row by row. An image that is smaller than its size and stride say gives none.
///
/// `sigma_px` is the standard deviation that the image's noise gives the weighted mean, with a floor for the pixel
/// grid; a blob cut by the border knows its place less well, which is added.
///
/// Formats: Mono8, Mono10, Mono12, Yuyv, Nv12. Fails with Unsupported for the packed ones and for Mjpeg (cameras hand
/// that on decoded), with InvalidArgument for sizes outside of 1 to 32767 and settings outside of their ranges.
Result<std::unique_ptr<Detector>> make_blob_detector(const DetectSettings& settings, PixelFormat format, int width_px,
                                                     int height_px);

}  // namespace mocap::stages
