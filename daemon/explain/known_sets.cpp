#include "explain/known_sets.h"

#include <algorithm>

namespace mocap::explain {
namespace {

// Smallest rigid body that is no chance fit.
constexpr std::size_t kMinRigidMarkers = 4;

}  // namespace

KnownSets::KnownSets(const std::vector<MarkerSet>& sets, const std::vector<Subject>& subjects,
                     const ExplainSettings& settings)
    : least_share_(settings.least_share) {
  for (const MarkerSet& set : sets) {
    const bool is_worn =
        std::ranges::any_of(subjects, [&](const Subject& each) { return each.marker_set.name == set.name; });
    if (is_worn) continue;
    sets_.push_back({set.name, set.markers.size(), set.skeleton.bones.size() == 1, PoseAttempts(set, settings)});
  }
}

std::optional<KnownSet> KnownSets::nearest(const MarkerSet& own_set, const PoseAttempt& own,
                                           std::span<const Eigen::Vector3d> points, std::size_t confirmed) {
  const bool is_rigid = own_set.skeleton.bones.size() == 1;
  const Known* best = nullptr;
  PoseAttempt of_best;
  for (Known& known : sets_) {
    if (known.is_rigid != is_rigid || (is_rigid && known.markers < kMinRigidMarkers)) continue;
    PoseAttempt attempt = known.attempts.best(points);
    const bool explains =
        is_rigid || static_cast<double>(attempt.matched) >= least_share_ * static_cast<double>(confirmed);
    if (!attempt.found || !explains || attempt.matched <= own.matched) continue;
    const bool better = best == nullptr || attempt.matched > of_best.matched ||
                        (attempt.matched == of_best.matched && attempt.rms_m < of_best.rms_m);
    if (!better) continue;
    best = &known;
    of_best = std::move(attempt);
  }
  if (best == nullptr) return std::nullopt;
  return KnownSet{best->name, best->markers};
}

}  // namespace mocap::explain
