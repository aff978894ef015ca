#include "calibration/diagnosis/camera_views.h"

#include <algorithm>

#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

PixelPoint flipped(PixelPoint at, const CameraModel& model, const ImageSource& source) {
  if (source.flip_x) at.v.x() = model.width_px - 1 - at.v.x();
  if (source.flip_y) at.v.y() = model.height_px - 1 - at.v.y();
  return at;
}

// Index of the image of a source at an instant; negative: none.
int image_at(const Instants& instants, std::size_t instant, const ImageSource& source) {
  const int image = instants.selected[instant].image[source.camera];
  if (image < 0) return image;
  const int shifted = image + source.shift;
  return shifted < static_cast<int>(instants.recording.cameras[source.camera].size()) ? shifted : -1;
}

}  // namespace

Instants select_instants(const Take& recording, std::size_t count) {
  std::vector<Instant> all = group_by_instant(recording, kMaxSkew);
  const auto needed = std::min<std::ptrdiff_t>(3, static_cast<std::ptrdiff_t>(recording.cameras.size()));
  std::erase_if(all, [&](const Instant& instant) {
    return std::ranges::count_if(instant.image, [](int image) { return image >= 0; }) < needed;
  });
  if (all.size() <= count) return {recording, std::move(all)};
  Instants instants{recording, {}};
  for (std::size_t i = 0; i < count; ++i) instants.selected.push_back(std::move(all[i * all.size() / count]));
  return instants;
}

CameraViews views_of(const Instants& instants, const CameraModel& model, const ImageSource& source) {
  CameraViews views{model, std::vector<std::vector<BlobView>>(instants.selected.size())};
  for (std::size_t i = 0; i < instants.selected.size(); ++i) {
    const int image = image_at(instants, i, source);
    if (image < 0) continue;
    for (const Spot& spot : instants.recording.cameras[source.camera][static_cast<std::size_t>(image)].spots) {
      const PixelPoint at = flipped(spot.at, model, source);
      if (const auto ray = geometry::undistort(model.lens, at)) views.instants[i].push_back({at, *ray});
    }
  }
  return views;
}

}  // namespace mocap::calibration
