#include "calibration/wand/place_wand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "calibration/sighting_of.h"
#include "geometry/lens.h"
#include "geometry/triangulation.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A wand longer or shorter than told by more is none.
constexpr double kLengthSlack = 0.25;
constexpr double kFewSigmas = 4.5;

class Placer {
 public:
  Placer(const WandViews& views, Bundle& bundle, const PlaceSettings& settings)
      : views_(views), bundle_(bundle), settings_(settings), marks_(bundle.wand.marks_m.size()) {}

  void place(std::size_t instant) {
    gather(instant);
    if (cameras_.size() < 2) return;
    if (bundle_.wand.reads_both_ways()) agree_on_ends();
    WandPlace place;
    if (!triangulate(place)) return;
    const std::size_t before = bundle_.sights.size();
    bundle_.places.push_back(place);
    for (std::size_t c = 0; c < bundle_.rig.size(); ++c) {
      if (const Picture* picture = views_.picture(c, instant)) pick(c, instant, *picture);
    }
    if (!held_by_two(before)) {
      bundle_.sights.resize(before);
      bundle_.places.pop_back();
    }
  }

 private:
  void gather(std::size_t instant) {
    cameras_.clear();
    rays_.clear();
    for (std::size_t c = 0; c < bundle_.rig.size(); ++c) {
      const auto& view = views_.of[c][instant];
      if (!view || static_cast<int>(c) == settings_.without) continue;
      WandRays rays;
      bool told = true;
      for (std::size_t m = 0; m < marks_ && told; ++m) {
        const auto& spot = views_.picture(c, instant)->spots[static_cast<std::size_t>(view->spots[m])];
        const auto ray = geometry::undistort(bundle_.rig[c].lens, spot.at);
        told = ray.has_value();
        if (told) rays.ray[m] = ray->v;
      }
      if (!told) continue;
      cameras_.push_back(c);
      rays_.push_back(rays);
    }
  }

  // The first camera's reading stands, the others' are turned to fit it.
  void agree_on_ends() {
    const auto world_from_first = bundle_.rig[cameras_[0]].camera_from_world.inverse();
    for (std::size_t i = 1; i < cameras_.size(); ++i) {
      const Between mine_from_first = bundle_.rig[cameras_[i]].camera_from_world * world_from_first;
      WandRays turned = rays_[i];
      std::reverse(turned.ray.begin(), turned.ray.begin() + static_cast<std::ptrdiff_t>(marks_));
      if (passing_by(mine_from_first, rays_[0], turned) < passing_by(mine_from_first, rays_[0], rays_[i]))
        rays_[i] = turned;
    }
  }

  // How far the rays of two cameras pass each other by, on the plane z = 1 of the second.
  double passing_by(const Between& b_from_a, const WandRays& a, const WandRays& b) const {
    double error = 0.0;
    for (std::size_t m = 0; m < marks_; ++m) {
      const auto point = meet(b_from_a, a.ray[m], b.ray[m]);
      if (!point) return 1e9;
      const Vector3d in_b = b_from_a.rotation * *point + b_from_a.translation;
      if (in_b.z() <= 0.0) return 1e9;
      error += (in_b.hnormalized() - b.ray[m]).norm();
    }
    return error;
  }

  bool triangulate(WandPlace& place) {
    std::array<Vector3d, kMostMarks> at;
    for (std::size_t m = 0; m < marks_; ++m) {
      sightings_.clear();
      for (std::size_t i = 0; i < cameras_.size(); ++i)
        sightings_.push_back(sighting_of(bundle_.rig[cameras_[i]], {rays_[i].ray[m]}, 0.1));
      const auto agreed = geometry::agree(sightings_, {.floor_px = settings_.gate_px, .sigmas = 4.0});
      if (!agreed) return false;
      at[m] = agreed->refined.point.v;
    }
    const Vector3d along = at[marks_ - 1] - at[0];
    const double length = along.norm();
    if (std::abs(length / bundle_.wand.length_m() - 1.0) > kLengthSlack) return false;
    place.along = along / length;
    place.middle_m = 0.5 * (at[0] + at[marks_ - 1]);
    return true;
  }

  // Each marker's nearest spot, if no other is nearly as near.
  void pick(std::size_t camera, std::size_t instant, const Picture& picture) {
    std::array<int, kMostMarks> chosen{-1, -1, -1};
    for (std::size_t m = 0; m < marks_; ++m) {
      const auto at =
          geometry::project(bundle_.rig[camera], bundle_.marker(bundle_.places.back(), static_cast<int>(m)));
      if (!at) continue;
      chosen[m] = nearest(picture, at->v);
    }
    for (std::size_t m = 0; m < marks_; ++m) {
      if (chosen[m] < 0) continue;
      if (std::ranges::count(chosen, chosen[m]) > 1) continue;
      const Spot& spot = picture.spots[static_cast<std::size_t>(chosen[m])];
      bundle_.sights.push_back({static_cast<int>(camera), static_cast<int>(bundle_.places.size()) - 1,
                                static_cast<int>(m), spot.at.v, spot.sigma_px, static_cast<int>(instant), chosen[m]});
    }
  }

  int nearest(const Picture& picture, const Vector2d& at) const {
    int best = -1;
    double least = settings_.gate_px;
    double second = 1e9;
    for (std::size_t s = 0; s < picture.spots.size(); ++s) {
      const double off = (picture.spots[s].at.v - at).norm();
      if (off < least) {
        second = best < 0 ? second : least;
        least = off;
        best = static_cast<int>(s);
      } else {
        second = std::min(second, off);
      }
    }
    return second < 2.0 * settings_.gate_px && second < 3.0 * least ? -1 : best;
  }

  bool held_by_two(std::size_t from) const {
    std::array<bool, 256> seen{};
    std::size_t cameras = 0;
    for (std::size_t s = from; s < bundle_.sights.size(); ++s) {
      auto& there = seen[static_cast<std::size_t>(bundle_.sights[s].camera) % seen.size()];
      cameras += there ? 0 : 1;
      there = true;
    }
    return cameras >= 2 && bundle_.sights.size() - from >= 4;
  }

  const WandViews& views_;
  Bundle& bundle_;
  PlaceSettings settings_;
  std::size_t marks_;
  std::vector<std::size_t> cameras_;
  std::vector<WandRays> rays_;
  std::vector<geometry::Sighting> sightings_;
};

double robust_sigma(const Bundle& bundle) {
  std::vector<double> off;
  for (const Sight& sight : bundle.sights) {
    if (const auto residual = bundle.residual_px(sight)) off.push_back(residual->norm());
  }
  if (off.empty()) return 0.0;
  std::ranges::nth_element(off, off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2));
  return off[off.size() / 2] / 1.1774;  // the median of a Rayleigh distribution
}

}  // namespace

void place_wand(const WandViews& views, Bundle& bundle, const PlaceSettings& settings) {
  bundle.places.clear();
  bundle.sights.clear();
  std::vector<std::size_t> worth;  // instants in which two cameras have the wand
  for (std::size_t i = 0; i < views.instants.size(); ++i) {
    int cameras = 0;
    for (std::size_t c = 0; c < views.of.size(); ++c) cameras += views.of[c][i] ? 1 : 0;
    if (cameras >= 2) worth.push_back(i);
  }
  Placer placer(views, bundle, settings);
  const std::size_t count = std::min(worth.size(), settings.most_samples);
  for (std::size_t i = 0; i < count; ++i) placer.place(worth[i * worth.size() / count]);  // evenly
}

std::size_t drop_outliers(Bundle& bundle) {
  const double most_px = kFewSigmas * robust_sigma(bundle);
  const std::size_t before = bundle.sights.size();
  std::erase_if(bundle.sights, [&](const Sight& sight) {
    const auto residual = bundle.residual_px(sight);
    return !residual || residual->norm() > most_px;
  });
  return before - bundle.sights.size();
}

}  // namespace mocap::calibration
