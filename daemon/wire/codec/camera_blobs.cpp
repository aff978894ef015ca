#include "wire/codec/camera_blobs.h"

#include <fmt/core.h>

#include <cmath>

#include "wire/codec/blob_columns.h"

namespace mocap::wire {
namespace {

// Far outside of any image, and small enough that a coordinate times a number of cells fits into an int.
constexpr double kMaxCoordinate_px = 1e6;

// Also false for a number that is not finite.
bool is_possible(const PixelPoint& at) {
  return std::abs(at.v.x()) <= kMaxCoordinate_px && std::abs(at.v.y()) <= kMaxCoordinate_px;
}

}  // namespace

void encode(const BlobFrame& from, v1::CameraBlobs& into) {
  into.Clear();
  into.set_camera(from.camera.value);
  into.set_number(from.number);
  into.set_exposed_at_ns(to_ns(from.exposed_at));
  into.set_received_at_ns(to_ns(from.received_at));
  into.set_detected_at_ns(to_ns(from.detected_at));
  for (const Blob& blob : from.blobs) {
    add_blob(into, blob);
    into.add_track_ids_plus_one(blob.track.value + 1);  // no track: the largest value becomes 0
  }
}

Status decode(const v1::CameraBlobs& from, BlobFrame& into) {
  into.blobs.clear();
  const int n = from.x_px_size();
  const bool alike = columns_agree(from) && from.track_ids_plus_one_size() == n;
  if (!alike || n > static_cast<int>(kMaxBlobs) || from.camera() >= kMaxCameras) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("blobs of camera {}: columns of different length, over {} blobs, or over {} cameras",
                             from.camera(), kMaxBlobs, kMaxCameras)};
  }
  into.camera = CameraId{from.camera()};
  into.number = from.number();
  into.exposed_at = from_ns(from.exposed_at_ns());
  into.received_at = from_ns(from.received_at_ns());
  into.detected_at = from_ns(from.detected_at_ns());
  for (int i = 0; i < n; ++i) {
    Blob blob = blob_at(from, i);
    blob.track = BlobTrackId{from.track_ids_plus_one(i) - 1};
    const bool valid = is_possible(blob.centroid) && std::isfinite(blob.sigma_px) && blob.sigma_px > 0.0 &&
                       std::isfinite(blob.area_px2) && std::isfinite(blob.peak) && std::isfinite(blob.roundness) &&
                       std::isfinite(blob.saturated) && !std::isinf(blob.axis_rad);
    if (!valid) {
      into.blobs.clear();
      return Error{
          ErrorCode::InvalidArgument,
          fmt::format("blobs of camera {}: blob {} has a number that is not finite, a position of ({}, {}) px, "
                      "or a sigma of {} px",
                      from.camera(), i, blob.centroid.v.x(), blob.centroid.v.y(), blob.sigma_px)};
    }
    into.blobs.push_back(blob);
  }
  return {};
}

Result<BlobFrame> decode(const v1::CameraBlobs& from) {
  BlobFrame into;
  if (const Status decoded = decode(from, into); !decoded) return decoded.error();
  return into;
}

}  // namespace mocap::wire
