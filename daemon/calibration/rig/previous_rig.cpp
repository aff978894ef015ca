#include "calibration/rig/previous_rig.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/expects.h"
#include "calibration/robust_statistics.h"
#include "geometry/rigid_fit.h"

namespace mocap::calibration {
namespace {

// Chosen by hand; not yet measured.
constexpr double kRatioTolerance = 0.005;
constexpr double kMinAgreement = 0.6;
// A camera that deviates by less was not moved. Chosen by hand; not yet measured.
constexpr double kMaxDeviation_m = 0.01;
// Cameras of a rig without extrinsics are all at the origin.
constexpr double kMinDistance_m = 0.05;

}  // namespace

std::optional<double> scale_of_previous(const Rig& rig, const Rig& previous) {
  MOCAP_EXPECTS(rig.size() == previous.size());
  if (rig.size() < 3) return std::nullopt;
  std::vector<double> ratios;
  for (std::size_t a = 0; a < rig.size(); ++a) {
    for (std::size_t b = a + 1; b < rig.size(); ++b) {
      const double before = (previous[a].centre().v - previous[b].centre().v).norm();
      if (before < kMinDistance_m) return std::nullopt;
      ratios.push_back((rig[a].centre().v - rig[b].centre().v).norm() / before);
    }
  }
  const double scale = median(ratios);
  const auto agreeing =
      std::ranges::count_if(ratios, [&](double r) { return std::abs(r / scale - 1.0) < kRatioTolerance; });
  if (static_cast<double>(agreeing) < kMinAgreement * static_cast<double>(ratios.size())) return std::nullopt;
  return scale;
}

std::optional<Floor> pose_in_previous_world(const Rig& rig, const Rig& previous) {
  MOCAP_EXPECTS(rig.size() == previous.size());
  std::vector<geometry::PointPair> pairs;
  for (std::size_t c = 0; c < rig.size(); ++c) pairs.push_back({rig[c].centre().v, previous[c].centre().v});
  const std::size_t min_cameras = std::max<std::size_t>(3, (rig.size() + 1) / 2);
  while (pairs.size() >= min_cameras) {
    const auto fit = geometry::fit_rigid(pairs);
    if (!fit) return std::nullopt;
    const auto distance = [&](const geometry::PointPair& pair) { return (fit->to_from * pair.from - pair.to).norm(); };
    const auto worst = std::ranges::max_element(pairs, {}, distance);
    if (distance(*worst) < kMaxDeviation_m) return Floor{fit->to_from, fit->rms_m};
    pairs.erase(worst);
  }
  return std::nullopt;
}

}  // namespace mocap::calibration
