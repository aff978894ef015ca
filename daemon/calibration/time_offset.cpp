#include "calibration/time_offset.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "calibration/place_wand.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kMostSamples = 1500;
constexpr std::size_t kLeastSamples = 30;
// Between two places further apart in time the wand did not go straight.
constexpr double kStraight_s = 0.12;
constexpr double kLeastMotion_px_s = 60.0;

struct Lag {
  double late_s;
  double weight;  // squared motion
};

// Where the wand's motion at a place leads in a camera's image, px/s: from the places before and after.
std::optional<Vector2d> motion_px_s(const WandViews& views, const Bundle& bundle, const Sight& sight,
                                    const std::vector<int>& instant_of) {
  const auto p = static_cast<std::size_t>(sight.place);
  if (p == 0 || p + 1 >= bundle.places.size()) return std::nullopt;
  const auto at = [&](std::size_t place) { return views.instants[static_cast<std::size_t>(instant_of[place])].at; };
  const double span_s = to_s(at(p + 1) - at(p - 1));
  if (!(span_s > 0.0) || span_s > kStraight_s) return std::nullopt;
  const CameraModel& camera = bundle.rig[static_cast<std::size_t>(sight.camera)];
  const auto before = geometry::project(camera, bundle.marker(bundle.places[p - 1], sight.mark));
  const auto after = geometry::project(camera, bundle.marker(bundle.places[p + 1], sight.mark));
  if (!before || !after) return std::nullopt;
  return (after->v - before->v) / span_s;
}

// The weighted median, which a wrong spot here and there does not move, and how far off it may be.
TimeOffset offset_of(std::vector<Lag>& lags) {
  if (lags.size() < kLeastSamples) return {0.0, std::numeric_limits<double>::infinity()};
  std::ranges::sort(lags, {}, &Lag::late_s);
  double total = 0.0;
  for (const Lag& lag : lags) total += lag.weight;
  const auto quantile = [&](double share) {
    double sum = 0.0;
    for (const Lag& lag : lags) {
      sum += lag.weight;
      if (sum >= share * total) return lag.late_s;
    }
    return lags.back().late_s;
  };
  // Half the middle two thirds stand for a standard deviation; a median is 1.25 times less sure than a mean.
  const double spread = 0.5 * (quantile(0.8413) - quantile(0.1587));
  return {quantile(0.5), 1.25 * spread / std::sqrt(static_cast<double>(lags.size()))};
}

}  // namespace

std::vector<TimeOffset> time_offsets(const WandViews& views, const Bundle& bundle, double gate_px) {
  std::vector<TimeOffset> offsets;
  Bundle placed{bundle.rig, bundle.wand, {}, {}};
  for (std::size_t c = 0; c < bundle.rig.size(); ++c) {
    place_wand(views, placed, {.gate_px = gate_px, .most_samples = kMostSamples, .without = static_cast<int>(c)});
    std::vector<int> instant_of(placed.places.size(), 0);
    for (const Sight& sight : placed.sights) instant_of[static_cast<std::size_t>(sight.place)] = sight.picture;
    std::vector<Lag> lags;
    for (const Sight& sight : placed.sights) {
      if (sight.camera != static_cast<int>(c)) continue;
      const auto motion = motion_px_s(views, placed, sight, instant_of);
      const auto residual = placed.residual_px(sight);
      if (!motion || !residual || motion->norm() < kLeastMotion_px_s) continue;
      lags.push_back({motion->dot(*residual) / motion->squaredNorm(), motion->squaredNorm()});
    }
    offsets.push_back(offset_of(lags));
  }
  return offsets;
}

}  // namespace mocap::calibration
