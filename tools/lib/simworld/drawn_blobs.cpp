#include "lib/simworld/drawn_blobs.h"

#include <utility>

#include "detect/blob_detector.h"

namespace mocap::simworld {

DrawnBlobs::DrawnBlobs(const Rig& rig, std::uint64_t seed) {
  scene::ImageSettings settings;
  settings.seed = seed;
  for (const CameraModel& camera : rig) {
    auto detector = detect::make_blob_detector({}, PixelFormat::Mono8, camera.width_px, camera.height_px);
    MOCAP_EXPECTS(detector.has_value());
    eyes_.push_back(
        {scene::Renderer(camera.width_px, camera.height_px, settings, eyes_.size()), std::move(*detector),
         std::vector<std::byte>(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px)),
         camera.width_px, camera.height_px});
  }
}

std::span<const std::uint32_t> DrawnBlobs::see(std::size_t camera, std::uint64_t number, std::span<const Spot> spots,
                                               Blobs& into) {
  Eye& eye = eyes_[camera];
  discs_.clear();
  for (const Spot& spot : spots) discs_.push_back({spot.centre_px, spot.centre_px, spot.radius_px, 1.0});
  eye.renderer.render(discs_, number, eye.pixels);
  const auto stride = static_cast<std::size_t>(eye.width_px);
  into = eye.detector->detect({eye.pixels, stride, eye.width_px, eye.height_px, PixelFormat::Mono8}).blobs;
  blob_of_.assign(spots.size(), BlobMaker::kNone);
  for (std::size_t i = 0; i < spots.size(); ++i) {
    double least_px = spots[i].radius_px + 2.0;  // the centroid of a merged blob lies between its discs
    for (std::uint32_t b = 0; b < into.size(); ++b) {
      const double off_px = (into[b].centroid.v - spots[i].centre_px).norm();
      if (off_px >= least_px) continue;
      least_px = off_px;
      blob_of_[i] = b;
    }
  }
  return blob_of_;
}

}  // namespace mocap::simworld
