#include "lib/simworld/wand_world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "geometry/lens.h"
#include "scene/ring_rig.h"

namespace mocap::simworld {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kBodyRadius_m = 0.2;
constexpr double kBodyHeight_m = 1.75;
constexpr double kArm_m = 0.7;  // distance from the axis of the body to the centre of the wand

Vector3d about(scene::Random& random, const Vector3d& middle, double share) {
  return middle.cwiseProduct(Vector3d::Ones() + share * Vector3d(2.0 * random.uniform() - 1.0,
                                                                 2.0 * random.uniform() - 1.0,
                                                                 2.0 * random.uniform() - 1.0));
}

Vector3d phases(scene::Random& random) {
  return 2.0 * std::numbers::pi * Vector3d(random.uniform(), random.uniform(), random.uniform());
}

constexpr double kFisheyeView_rad = 2.2;

void bend(Lens& lens, bool fisheye, int width_px, scene::Random& random) {
  const auto about_zero = [&](double most) { return most * (2.0 * random.uniform() - 1.0); };
  if (fisheye) lens.fx_px = width_px / kFisheyeView_rad;
  lens.fx_px *= 1.0 + about_zero(0.05);
  lens.fy_px = lens.fx_px * (1.0 + about_zero(0.002));
  lens.cx_px += about_zero(12.0);
  lens.cy_px += about_zero(12.0);
  if (fisheye) {
    lens.kind = LensKind::Fisheye;
    lens.distortion << -0.02 + about_zero(0.02), about_zero(0.01), about_zero(0.004), about_zero(0.001), 0.0;
    return;
  }
  lens.distortion << -0.12 + about_zero(0.06), 0.06 + about_zero(0.04), about_zero(0.0008), about_zero(0.0008), 0.0;
}

}  // namespace

WandWorld::WandWorld(const WandWorldSettings& settings, const calibration::Wand& wand, std::uint64_t seed)
    : settings_(settings), wand_(wand), random_(seed) {
  truth_ = scene::ring_rig({.cameras = settings.cameras,
                            .radius_m = 4.0,
                            .height_m = 2.5,
                            .width_px = 1280,
                            .height_px = 1024,
                            .hfov_rad = 1.1});
  for (CameraModel& camera : truth_) {
    const Vector3d eye = camera.centre().v + 0.25 * Vector3d(random_.normal(), random_.normal(), random_.normal());
    const Vector3d target =
        Vector3d(0.0, 0.0, 1.0) + 0.2 * Vector3d(random_.normal(), random_.normal(), random_.normal());
    camera.camera_from_world = scene::look_at(eye, target);
    bend(camera.lens, settings.fisheye, camera.width_px, random_);
  }
  slow_ = {about(random_, {0.043, 0.057, 0.071}, 0.1), phases(random_)};
  quick_ = {about(random_, {0.31, 0.37, 0.43}, 0.1), phases(random_)};
  turning_ = {about(random_, {0.11, 0.17, 0.23}, 0.1), phases(random_)};
}

Vector3d WandWorld::wave(const Wave& wave, double t) const {
  return (2.0 * std::numbers::pi * t * wave.hz + wave.phase).array().sin();
}

Vector2d WandWorld::noise() { return settings_.noise_px * Vector2d(random_.normal(), random_.normal()); }

bool WandWorld::hidden(const Vector3d& from, const Vector3d& to, const Vector3d& body) const {
  const Vector2d along = (to - from).head<2>();
  const double share = std::clamp((body - from).head<2>().dot(along) / along.squaredNorm(), 0.0, 1.0);
  const Vector3d nearest = from + share * (to - from);
  return (nearest - body).head<2>().norm() < kBodyRadius_m && nearest.z() < kBodyHeight_m;
}

void WandWorld::see(const CameraModel& camera, std::span<const Vector3d> marks, const Vector3d& body,
                    calibration::Picture& picture) {
  for (const Vector3d& mark : marks) {
    const auto at = geometry::project(camera, {mark});
    if (!at || !geometry::in_image(camera, *at)) continue;
    if (settings_.body && hidden(camera.centre().v, mark, body)) continue;
    picture.spots.push_back({{at->v + noise()}, settings_.noise_px});
    if (random_.uniform() >= settings_.false_blobs) continue;
    const Vector2d anywhere(random_.uniform() * camera.width_px, random_.uniform() * camera.height_px);
    picture.spots.push_back({{anywhere}, settings_.noise_px});
  }
  // The order of the spots must not reveal the order of the wand's markers.
  std::ranges::sort(picture.spots, {}, [](const calibration::Spot& spot) { return spot.at.v.y(); });
}

calibration::Take WandWorld::take() {
  calibration::Take take;
  take.cameras.resize(truth_.size());
  const int count = static_cast<int>(settings_.seconds * settings_.rate_hz);
  std::vector<Vector3d> marks(wand_.marks_m.size());
  for (int i = 0; i < count; ++i) {
    const double t = i / settings_.rate_hz;
    const Vector3d middle = Vector3d(0.0, 0.0, 1.15) + wave(slow_, t).cwiseProduct(Vector3d(1.3, 1.3, 0.55)) +
                            wave(quick_, t).cwiseProduct(Vector3d(0.25, 0.25, 0.2));
    const Vector3d turn = wave(turning_, t).cwiseProduct(Vector3d(std::numbers::pi, 1.2, 0.0));
    const Vector3d along(std::cos(turn.x()) * std::cos(turn.y()), std::sin(turn.x()) * std::cos(turn.y()),
                         std::sin(turn.y()));
    for (std::size_t m = 0; m < marks.size(); ++m) marks[m] = middle + (wand_.marks_m[m] - wand_.middle_m()) * along;
    const double side = 2.0 * std::numbers::pi * 0.03 * t;
    const Vector3d body = middle + kArm_m * Vector3d(std::cos(side), std::sin(side), 0.0);
    for (std::size_t c = 0; c < truth_.size(); ++c) {
      calibration::Picture& picture = take.cameras[c].emplace_back();
      picture.exposed_at = from_ns(0) + from_s(t);
      see(truth_[c], marks, body, picture);
    }
  }
  return take;
}

Rig WandWorld::rough_lenses(double share) {
  Rig rig = truth_;
  for (CameraModel& camera : rig) {
    const double wrong = 1.0 + share * (2.0 * random_.uniform() - 1.0);
    camera.lens.fx_px *= wrong;
    camera.lens.fy_px = camera.lens.fx_px;
    camera.lens.cx_px = 0.5 * (camera.width_px - 1);
    camera.lens.cy_px = 0.5 * (camera.height_px - 1);
    camera.lens.distortion.setZero();
    camera.lens.is_from_fov = true;
    camera.camera_from_world = {};
  }
  return rig;
}

}  // namespace mocap::simworld
