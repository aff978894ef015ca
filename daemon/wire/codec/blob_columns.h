#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>

#include "model/blob.h"

// The columns of blobs that mocap.v1.CameraBlobs (takes, nodes) and mocap.v1.BlobPicture (blob recordings) have in
// common: `Message` is one of them. Their numbers differ in precision.
namespace mocap::wire {

/// Bits of the column `flags`.
inline constexpr std::uint32_t kTouchesBorder = 1;
inline constexpr std::uint32_t kMerged = 2;

/// Whether all columns have the length of `x_px`.
template <class Message>
bool columns_agree(const Message& message) {
  const int n = message.x_px_size();
  return message.y_px_size() == n && message.sigma_px_size() == n && message.area_px2_size() == n &&
         message.peak_size() == n && message.roundness_size() == n && message.axis_rad_size() == n &&
         message.saturated_size() == n && message.flags_size() == n;
}

/// Row `i` of the columns, without the 2D track. Requires columns_agree.
template <class Message>
Blob blob_at(const Message& message, int i) {
  Blob blob;
  blob.centroid.v = {message.x_px(i), message.y_px(i)};
  blob.sigma_px = message.sigma_px(i);
  blob.area_px2 = message.area_px2(i);
  blob.peak = message.peak(i);
  blob.roundness = message.roundness(i);
  blob.axis_rad = message.axis_rad(i);
  blob.saturated = message.saturated(i);
  blob.touches_border = (message.flags(i) & kTouchesBorder) != 0;
  blob.merged = (message.flags(i) & kMerged) != 0;
  return blob;
}

/// Appends a row, without the 2D track.
template <class Message>
void add_blob(Message& message, const Blob& blob) {
  using Number = std::decay_t<decltype(std::declval<const Message&>().sigma_px(0))>;
  message.add_x_px(blob.centroid.v.x());
  message.add_y_px(blob.centroid.v.y());
  message.add_sigma_px(static_cast<Number>(blob.sigma_px));
  message.add_area_px2(static_cast<Number>(blob.area_px2));
  message.add_peak(static_cast<Number>(blob.peak));
  message.add_roundness(static_cast<Number>(blob.roundness));
  message.add_axis_rad(static_cast<Number>(blob.axis_rad));
  message.add_saturated(static_cast<Number>(blob.saturated));
  message.add_flags((blob.touches_border ? kTouchesBorder : 0U) | (blob.merged ? kMerged : 0U));
}

}  // namespace mocap::wire
