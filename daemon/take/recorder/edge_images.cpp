#include "take/recorder/edge_images.h"

#include <algorithm>

namespace mocap::take {

bool EdgeImages::add(const BufferedMessage& image) {
  if (std::erase(awaited_, std::pair(image.camera, image.at)) > 0) return true;
  waiting_.push_back({image.camera, image.at, std::string(image.bytes)});
  return false;
}

const std::vector<EdgeImages::Image>& EdgeImages::take(const v1::Snapshot& set) {
  taken_.clear();
  awaited_.clear();
  const v1::Views& views = set.views();
  const int count = std::min(views.cameras_size(), views.skews_ns_size());
  for (int view = 0; view < count; ++view) {
    const std::uint32_t camera = views.cameras(view);
    const Timestamp at = from_ns(set.instants().exposed_at_ns() + views.skews_ns(view));
    const auto found =
        std::ranges::find_if(waiting_, [&](const Image& image) { return image.camera == camera && image.at == at; });
    if (found == waiting_.end()) {
      awaited_.emplace_back(camera, at);
    } else {
      taken_.push_back(std::move(*found));
      waiting_.erase(found);
    }
  }
  return taken_;
}

void EdgeImages::forget(Timestamp up_to) {
  std::erase_if(waiting_, [&](const Image& image) { return image.at <= up_to; });
}

}  // namespace mocap::take
