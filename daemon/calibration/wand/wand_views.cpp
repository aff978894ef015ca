#include "calibration/wand/wand_views.h"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/median.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;

// A wand that moves by less than this over a whole take, in every camera, is not waved.
constexpr double kLeastMotion_px = 15.0;
// Of the pictures of a camera with a wand: with so many a second one it is no chance of clutter.
constexpr double kTwoWands = 0.2;
constexpr double kOutside_px = 2.0;

struct CameraLook {
  std::size_t pictures = 0;
  std::size_t seen = 0;
  std::size_t twice = 0;
  std::size_t outside = 0;
  std::size_t spots = 0;
  std::vector<double> divided;  // where the middle one of any three spots on a line divides them
  Vector2d least = Vector2d::Constant(1e9);
  Vector2d most = Vector2d::Constant(-1e9);
};

class Looker {
 public:
  Looker(const CameraModel& camera, const Wand& wand, const WandSettings& settings)
      : camera_(camera), wand_(wand), shape_(wand_shape(settings.lens_known)) {
    // The same stick with a marker anywhere between its ends: to tell a wrong wand from none.
    any_.marks_m = {0.0, 0.5, 1.0};
    any_shape_ = shape_;
    any_shape_.ratio_slack = 0.4;
  }

  std::optional<WandView> look(const Picture& picture, CameraLook& total) {
    flat_.clear();
    rays_.clear();
    index_.clear();
    ++total.pictures;
    for (std::size_t i = 0; i < picture.spots.size(); ++i) {
      const Vector2d& at = picture.spots[i].at.v;
      ++total.spots;
      const bool inside = at.x() > -kOutside_px && at.y() > -kOutside_px && at.x() < camera_.width_px + kOutside_px &&
                          at.y() < camera_.height_px + kOutside_px;
      total.outside += inside ? 0 : 1;
      const auto ray = geometry::undistort(camera_.lens, {at});
      if (!ray) continue;
      rays_.push_back(ray->v);
      flat_.push_back(ray->v * camera_.lens.fx_px);
      index_.push_back(static_cast<int>(i));
    }
    const WandLook found = find_wand(flat_, wand_, shape_);
    if (found.twice) ++total.twice;
    if (wand_.marks_m.size() == 3 && flat_.size() == 3) note_division(total);
    if (!found.seen) return std::nullopt;
    ++total.seen;
    return view_of(found.spots, total);
  }

 private:
  void note_division(CameraLook& total) const {
    const WandLook any = find_wand(flat_, any_, any_shape_);
    if (any.spots[0] < 0) return;
    const auto at = [&](int mark) {
      return flat_[static_cast<std::size_t>(any.spots[static_cast<std::size_t>(mark)])];
    };
    const double share = (at(1) - at(0)).norm() / (at(2) - at(0)).norm();
    total.divided.push_back(std::min(share, 1.0 - share));
  }

  WandView view_of(const WandSpots& spots, CameraLook& total) const {
    WandView view;
    view.rays.either_way = wand_.reads_both_ways();
    for (std::size_t m = 0; m < wand_.marks_m.size(); ++m) {
      const auto spot = static_cast<std::size_t>(spots[m]);
      view.spots[m] = index_[spot];
      view.rays.ray[m] = rays_[spot];
      total.least = total.least.cwiseMin(flat_[spot]);
      total.most = total.most.cwiseMax(flat_[spot]);
    }
    return view;
  }

  const CameraModel& camera_;
  const Wand& wand_;
  WandShape shape_;
  Wand any_;
  WandShape any_shape_;
  std::vector<Vector2d> flat_;
  std::vector<Vector2d> rays_;
  std::vector<int> index_;
};

std::optional<WandRefusal> refuse(const CameraModel& camera, const CameraLook& look, const Wand& wand) {
  if (look.spots > 50 && 20 * look.outside > look.spots) {
    return WandRefusal{
        WandFault::WrongImageSize,
        fmt::format("camera '{}': {} of {} spots lie outside of {}x{} px, the size that its lens file is "
                    "for; give the lens file of the size that is captured",
                    camera.name, look.outside, look.spots, camera.width_px, camera.height_px)};
  }
  if (static_cast<double>(look.twice) > kTwoWands * static_cast<double>(look.pictures) && look.twice > look.seen / 2) {
    return WandRefusal{WandFault::TwoWands,
                       fmt::format("camera '{}': two wands in {} of {} pictures; take one out of the volume, or cover "
                                   "what looks like one",
                                   camera.name, look.twice, look.pictures)};
  }
  if (wand.marks_m.size() == 3 && look.divided.size() > 20 && 4 * look.seen < look.divided.size()) {
    const double told = wand.marks_m[1] / wand.length_m();
    return WandRefusal{
        WandFault::WrongWand,
        fmt::format("camera '{}': {} pictures show three markers on a line whose middle one divides it at {:.2f}, "
                    "expected {:.2f} of the wand that was told ({:.0f}, {:.0f}, {:.0f} mm); say the distances of yours "
                    "with --wand",
                    camera.name, look.divided.size(), median(look.divided), std::min(told, 1.0 - told),
                    1e3 * wand.marks_m[0], 1e3 * wand.marks_m[1], 1e3 * wand.marks_m[2])};
  }
  if (look.seen == 0) {
    return WandRefusal{WandFault::NoWand,
                       fmt::format("camera '{}': no wand in any of {} pictures ({} spots); wave it where this camera "
                                   "looks, check exposure and threshold",
                                   camera.name, look.pictures, look.spots)};
  }
  return std::nullopt;
}

}  // namespace

const Picture* WandViews::picture(std::size_t camera, std::size_t instant) const {
  const int index = instants[instant].picture[camera];
  return index < 0 ? nullptr : &take->cameras[camera][static_cast<std::size_t>(index)];
}

Result<WandViews, WandRefusal> look_for_wand(const Take& take, const Rig& rig, const Wand& wand,
                                             const WandSettings& settings) {
  WandViews views;
  views.take = &take;
  views.instants = gather_instants(take, settings.most_skew);
  views.of.resize(rig.size());
  bool moved = false;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    Looker looker(rig[c], wand, settings);
    CameraLook total;
    views.of[c].resize(views.instants.size());
    for (std::size_t i = 0; i < views.instants.size(); ++i) {
      if (const Picture* picture = views.picture(c, i)) views.of[c][i] = looker.look(*picture, total);
    }
    if (auto refusal = refuse(rig[c], total, wand)) return *std::move(refusal);
    // What moved beyond the wand's own length in the image.
    double length = 0.0;
    for (const auto& view : views.of[c]) {
      if (!view) continue;
      length = (view->rays.ray[0] - view->rays.ray[wand.marks_m.size() - 1]).norm() * rig[c].lens.fx_px;
      break;
    }
    moved = moved || (total.most - total.least).norm() > length + kLeastMotion_px;
  }
  if (!moved) {
    return WandRefusal{WandFault::StillWand,
                       fmt::format("the wand lies still: in no camera it moved by more than {:.0f} "
                                   "px; wave it through the whole volume",
                                   kLeastMotion_px)};
  }
  return views;
}

}  // namespace mocap::calibration
