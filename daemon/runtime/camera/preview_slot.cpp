#include "runtime/camera/preview_slot.h"

#include "detect/decimate.h"
#include "detect/pixel_rows.h"

namespace mocap::runtime {

bool PreviewSlot::offer(const Frame& frame, const Blobs& blobs) {
  if (!wanted_.load(std::memory_order_relaxed) || full_.load(std::memory_order_acquire)) return false;
  // An earlier time than the last one: the recording of a replay began again.
  if (offered_at_ && frame.received_at >= *offered_at_ && frame.received_at - *offered_at_ < kPreviewPeriod)
    return false;
  const Image& image = frame.image;
  if (!detect::is_whole(image)) return false;
  offered_at_ = frame.received_at;
  const int step = preview_step(image.width_px, image.height_px);
  image_.head = {frame.camera, frame.number, frame.exposed_at, image.width_px, image.height_px, step, {}};
  for (const Blob& blob : blobs) {
    image_.head.blobs.push_back({static_cast<float>(blob.centroid.v.x()), static_cast<float>(blob.centroid.v.y()),
                                 static_cast<float>(blob.area_px2)});
  }
  image_.grey.reserve(static_cast<std::size_t>(kMaxPreview_px) * kMaxPreview_px);
  image_.grey.resize(static_cast<std::size_t>(image_.head.width_px()) *
                     static_cast<std::size_t>(image_.head.height_px()));
  detect::decimate(image, step, image_.grey);
  full_.store(true, std::memory_order_release);
  return true;
}

}  // namespace mocap::runtime
