#include "associate/uncalibrated_views.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "model/calibration/calibrated_camera.h"

namespace mocap::associate {
namespace {

// A camera 10 km above the floor that looks up.
constexpr double kFarAway_m = 1e4;
constexpr int kSide_px = 1000;

class CalibratedViewsMatcher : public Matcher {
 public:
  CalibratedViewsMatcher(std::unique_ptr<Matcher> inner, const Rig& rig)
      : inner_(std::move(inner)), empty_(rig.size()) {
    for (const CameraModel& camera : rig) is_calibrated_.push_back(is_calibrated(camera));
  }

  const Matches& match(const FrameSet& frames, const Predictions& predicted) override {
    shown_ = frames;
    for (const BlobFrame*& view : shown_.views) {
      const std::size_t camera = view->camera.value;
      if (is_calibrated_[camera]) continue;
      BlobFrame& empty = empty_[camera];
      empty.camera = view->camera;
      empty.number = view->number;
      empty.exposed_at = view->exposed_at;
      empty.received_at = view->received_at;
      empty.detected_at = view->detected_at;
      view = &empty;
    }
    return inner_->match(shown_, predicted);
  }

  void archive(Archive& members) override { inner_->archive(members); }

 private:
  std::unique_ptr<Matcher> inner_;
  std::vector<bool> is_calibrated_;  // by camera
  std::vector<BlobFrame> empty_;     // by camera: its images without blobs
  FrameSet shown_;
};

}  // namespace

Rig with_blind_models(Rig rig) {
  for (CameraModel& camera : rig) {
    if (is_calibrated(camera)) continue;
    camera.width_px = camera.height_px = kSide_px;
    camera.lens = {};
    camera.lens.fx_px = camera.lens.fy_px = kSide_px;
    camera.lens.cx_px = camera.lens.cy_px = 0.5 * (kSide_px - 1);
    camera.camera_from_world = {};
    camera.camera_from_world.translation.z() = -kFarAway_m;
  }
  return rig;
}

std::unique_ptr<Matcher> without_uncalibrated_views(std::unique_ptr<Matcher> inner, const Rig& rig) {
  if (std::ranges::all_of(rig, is_calibrated)) return inner;
  return std::make_unique<CalibratedViewsMatcher>(std::move(inner), rig);
}

}  // namespace mocap::associate
