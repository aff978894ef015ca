#include "calibration/rig/old_rig.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/expects.h"
#include "calibration/median.h"
#include "geometry/rigid_fit.h"

namespace mocap::calibration {
namespace {

constexpr double kAlike = 0.005;
constexpr double kMostShare = 0.6;
constexpr double kStill_m = 0.01;
// A rig of lenses alone has all its cameras in one place.
constexpr double kLeastApart_m = 0.05;

}  // namespace

std::optional<double> times_larger(const Rig& rig, const Rig& old) {
  MOCAP_EXPECTS(rig.size() == old.size());
  if (rig.size() < 3) return std::nullopt;
  std::vector<double> ratios;
  for (std::size_t a = 0; a < rig.size(); ++a) {
    for (std::size_t b = a + 1; b < rig.size(); ++b) {
      const double before = (old[a].centre().v - old[b].centre().v).norm();
      if (before < kLeastApart_m) return std::nullopt;
      ratios.push_back((rig[a].centre().v - rig[b].centre().v).norm() / before);
    }
  }
  const double most = median(ratios);
  const auto alike = std::ranges::count_if(ratios, [&](double r) { return std::abs(r / most - 1.0) < kAlike; });
  if (static_cast<double>(alike) < kMostShare * static_cast<double>(ratios.size())) return std::nullopt;
  return most;
}

std::optional<Floor> floor_of_old(const Rig& rig, const Rig& old) {
  MOCAP_EXPECTS(rig.size() == old.size());
  std::vector<geometry::PointPair> pairs;
  for (std::size_t c = 0; c < rig.size(); ++c) pairs.push_back({rig[c].centre().v, old[c].centre().v});
  const std::size_t least = std::max<std::size_t>(3, (rig.size() + 1) / 2);
  while (pairs.size() >= least) {
    const auto fit = geometry::fit_rigid(pairs);
    if (!fit) return std::nullopt;
    const auto off = [&](const geometry::PointPair& pair) { return (fit->to_from * pair.from - pair.to).norm(); };
    const auto worst = std::ranges::max_element(pairs, {}, off);
    if (off(*worst) < kStill_m) return Floor{fit->to_from, fit->rms_m};
    pairs.erase(worst);
  }
  return std::nullopt;
}

}  // namespace mocap::calibration
