#pragma once

#include <cstddef>
#include <vector>

#include "calibration/wand/instants.h"
#include "calibration/wand/wand_recording.h"
#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::calibration {

/// The images that a camera of the rig is supposed to have, under one hypothesis.
struct ImageSource {
  std::size_t camera = 0;  ///< index in the recording
  bool flip_x = false;     ///< the image is read from right to left
  bool flip_y = false;     ///< the image is read from bottom to top
  int shift = 0;           ///< images later than the image of the instant; negative: earlier
};

/// One blob with its viewing ray.
struct BlobView {
  PixelPoint at;  ///< after the flips of the source
  NormalizedPoint ray;
};

/// A camera of the rig under one hypothesis: its model, and its blobs at each instant.
struct CameraViews {
  CameraModel model;
  std::vector<std::vector<BlobView>> instants;
};

/// A recording at selected instants.
struct Instants {
  const Take& recording;          ///< borrowed
  std::vector<Instant> selected;  ///< in the order of time
};

/// At most `count` instants with images of three cameras or more (two, if the recording has only two), evenly spread
/// over the recording.
Instants select_instants(const Take& recording, std::size_t count);

/// The blobs of `source` as views of `model`. Blobs without a ray, and instants without an image, give no views.
CameraViews views_of(const Instants& instants, const CameraModel& model, const ImageSource& source);

}  // namespace mocap::calibration
