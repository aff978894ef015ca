#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/bounds.h"
#include "model/ids.h"

namespace mocap {

/// Width and height of a preview have at most this size.
inline constexpr int kMaxPreview_px = 640;

struct PreviewBlob {
  float x_px = 0.0F;  ///< in the camera's image
  float y_px = 0.0F;
  float area_px2 = 0.0F;
};

/// The properties of a preview: camera, image, scale.
struct PreviewHead {
  CameraId camera;
  std::uint64_t number = 0;  ///< the camera's own count of exposures
  Timestamp exposed_at;
  int image_width_px = 0;  ///< of the camera's image
  int image_height_px = 0;
  int step = 1;  ///< the preview has every step-th pixel of every step-th row
  BoundedVector<PreviewBlob, kMaxBlobs> blobs;

  int width_px() const { return (image_width_px + step - 1) / step; }
  int height_px() const { return (image_height_px + step - 1) / step; }
};

struct PreviewImage {
  PreviewHead head;
  std::vector<std::uint8_t> grey;  ///< row by row
};

struct Preview {
  PreviewHead head;
  std::vector<std::byte> jpeg;
};

/// The least step for which the preview of an image of this size has at most kMaxPreview_px.
constexpr int preview_step(int width_px, int height_px) {
  const int longer = width_px > height_px ? width_px : height_px;
  return (longer + kMaxPreview_px - 1) / kMaxPreview_px;
}

}  // namespace mocap
