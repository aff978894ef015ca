#include "wire/codec/encode.h"

namespace mocap::wire {

void encode(const Preview& from, v1::Preview& into) {
  into.Clear();
  into.set_frame_number(from.head.number);
  into.set_exposed_at_ns(to_ns(from.head.exposed_at));
  into.set_width_px(static_cast<std::uint32_t>(from.head.image_width_px));
  into.set_height_px(static_cast<std::uint32_t>(from.head.image_height_px));
  into.set_step(static_cast<std::uint32_t>(from.head.step));
  into.set_jpeg(from.jpeg.data(), from.jpeg.size());
  for (const PreviewBlob& blob : from.head.blobs) {
    into.add_x_px(blob.x_px);
    into.add_y_px(blob.y_px);
    into.add_area_px2(blob.area_px2);
  }
}

}  // namespace mocap::wire
