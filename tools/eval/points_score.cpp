#include "eval/points_score.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>

#include "geometry/lens.h"

namespace mocap::eval {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::uint32_t kNobody = geometry::Assigner::kUnassigned;
constexpr std::size_t kMaxPairs = 1 << 16;
// Gate between an output and its light: the larger of 10 mm (about the size of a marker) and 5 standard deviations of
// the Cramer-Rao bound.
constexpr double kLeastGate_m = 0.010;
constexpr double kGateSigmas = 5.0;

double nees_of(const Vector3d& error, const Matrix3d& covariance) { return error.dot(covariance.inverse() * error); }

}  // namespace

PointsScorer::PointsScorer(const Rig& rig, double noise_px, PointsScore& score)
    : rig_(rig), noise_px_(noise_px), score_(score), assigner_(kMaxMarkers, kMaxMarkers, kMaxPairs) {}

void PointsScorer::add(const simworld::SeenInstant& truth, const Matches& matches, const Markers& markers,
                       const Predictions& expected, const TrackedMarkers& tracked) {
  last_track_.resize(truth.lights.size(), kNobody);
  last_set_.resize(truth.lights.size(), 0);
  ++set_;
  ++score_.sets;
  score_.skipped += matches.skipped;
  find_bounds(truth);
  score_points(truth, markers, expected);
  score_tracks(truth, tracked);
}

// Cramer-Rao bound from the true rays: each view measures both image axes with noise_px.
PointsScorer::Bound PointsScorer::bound_of(const Vector3d& light, std::uint64_t cameras) const {
  constexpr double kStep_m = 1e-5;
  Bound bound;
  bound.gate_m = kLeastGate_m;
  Matrix3d information = Matrix3d::Zero();
  for (std::size_t c = 0; c < rig_.size(); ++c) {
    if ((cameras >> c & 1) == 0) continue;
    Eigen::Matrix<double, 2, 3> slope;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = kStep_m * Vector3d::Unit(axis);
      const auto after = geometry::project(rig_[c], {light + step});
      const auto before = geometry::project(rig_[c], {light - step});
      if (!after || !before) return bound;
      slope.col(axis) = (after->v - before->v) / (2.0 * kStep_m * noise_px_);
    }
    information += slope.transpose() * slope;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(information);
  if (!(eigen.eigenvalues()[0] > 1e2)) return bound;  // position uncertain by more than 0.1 m
  bound.observable = true;
  bound.covariance_m2 = information.inverse();
  bound.gate_m = std::max(kLeastGate_m, kGateSigmas / std::sqrt(eigen.eigenvalues()[0]));
  return bound;
}

void PointsScorer::find_bounds(const simworld::SeenInstant& truth) {
  bounds_.clear();
  for (std::size_t i = 0; i < truth.lights.size(); ++i) {
    bounds_.push_back(truth.lights[i].there ? bound_of(truth.lights[i].position, truth.alone_in[i]) : Bound{});
    if (!truth.lights[i].there) continue;
    ++score_.lights;
    score_.views += static_cast<std::uint64_t>(std::popcount(truth.alone_in[i] | truth.merged_in[i]));
  }
}

// Assigns outputs to lights one to one, with the least sum of squared normalised distances.
void PointsScorer::pair_up(const simworld::SeenInstant& truth, const std::vector<Vector3d>& places) {
  pairs_.clear();
  for (std::uint32_t i = 0; i < truth.lights.size(); ++i) {
    if (!truth.lights[i].there) continue;
    for (std::uint32_t p = 0; p < places.size(); ++p) {
      const double cost = (places[p] - truth.lights[i].position).squaredNorm() / std::pow(bounds_[i].gate_m, 2);
      if (cost < 1.0 && pairs_.size() < kMaxPairs) pairs_.push_back({i, p, cost});
    }
  }
  // An unassigned light costs more than any pair inside its gate.
  const auto columns = assigner_.assign(truth.lights.size(), places.size(), pairs_, 4.0);
  place_of_.assign(columns.begin(), columns.end());
}

// Whether a track was assigned to the light in the last set, or predicts it now within four standard deviations.
bool PointsScorer::is_known(std::size_t light, const Vector3d& place, const Predictions& expected) const {
  const auto prediction =
      std::ranges::find_if(expected.markers, [&](const auto& m) { return m.track.value == last_track_[light]; });
  if (last_track_[light] == kNobody || prediction == expected.markers.end()) return false;
  return last_set_[light] + 1 == set_ || nees_of(place - prediction->position.v, prediction->covariance_m2) < 16.0;
}

void PointsScorer::score_points(const simworld::SeenInstant& truth, const Markers& markers,
                                const Predictions& expected) {
  std::vector<Vector3d> places;
  for (const Marker& marker : markers) places.push_back(marker.position.v);
  pair_up(truth, places);
  missed_.clear();
  std::size_t right = 0;
  for (std::size_t i = 0; i < truth.lights.size(); ++i) {
    const bool found = place_of_[i] != kNobody;
    right += found ? 1 : 0;
    const int alone = std::popcount(truth.alone_in[i]);
    const int seen = std::popcount(truth.alone_in[i] | truth.merged_in[i]);
    if (alone >= 3) {
      score_.seen_by_3plus.count(found);
    } else if (alone == 2 && seen == 2) {
      const bool known = is_known(i, truth.lights[i].position, expected);
      (known ? score_.seen_by_2_known : score_.seen_by_2_new).count(found);
      if (known && !found) missed_.push_back(i);
    } else if (seen >= 2) {
      score_.merged.count(found);
    }
    if (!found) continue;
    const Marker& marker = markers[place_of_[i]];
    const Vector3d error = marker.position.v - truth.lights[i].position;
    if (seen != alone) {
      score_.squared_error_merged_m2.add(error.squaredNorm());
    } else if (bounds_[i].observable) {
      score_.squared_error_m2.add(error.squaredNorm());
      score_.bound_m2.add(bounds_[i].covariance_m2.trace());
      score_.nees.add(nees_of(error, marker.covariance_m2));
    }
  }
  score_.point_ghosts += markers.size() - right;
}

void PointsScorer::score_tracks(const simworld::SeenInstant& truth, const TrackedMarkers& tracked) {
  std::vector<Vector3d> places;
  std::vector<const TrackedMarker*> seen;
  for (const TrackedMarker& track : tracked) {
    if (track.id.value >= next_track_) {
      ++score_.initiated;
      next_track_ = track.id.value + 1;
    }
    if (track.state != TrackState::Confirmed) continue;
    places.push_back(track.position.v);
    seen.push_back(&track);
  }
  pair_up(truth, places);
  ghosts_ = seen;
  for (std::size_t i = 0; i < truth.lights.size(); ++i) {
    const bool found = place_of_[i] != kNobody;
    const int views = std::popcount(truth.alone_in[i] | truth.merged_in[i]);
    if (views >= 2) score_.tracked.count(found);
    if (!found) continue;
    const TrackedMarker& track = *seen[place_of_[i]];
    ghosts_[place_of_[i]] = nullptr;
    if (last_track_[i] != kNobody && last_track_[i] != track.id.value) {
      ++score_.id_changes;
      score_.id_changes_named += truth.lights[i].is_labelled ? 1 : 0;
      score_.id_changes_in_view += last_set_[i] + 1 == set_ ? 1 : 0;
    }
    last_track_[i] = track.id.value;
    last_set_[i] = set_;
    const Vector3d error = track.position.v - truth.lights[i].position;
    if (truth.merged_in[i] != 0 || !bounds_[i].observable) continue;
    score_.squared_error_track_m2.add(error.squaredNorm());
    score_.nees_track.add(nees_of(error, track.covariance_m2));
  }
  std::erase(ghosts_, nullptr);
  score_.ghosts += ghosts_.size();
  for (const TrackedMarker& track : tracked) {
    if (track.state != TrackState::Coasting) continue;
    for (std::size_t i = 0; i < truth.lights.size(); ++i) {
      if (!truth.lights[i].there || last_track_[i] != track.id.value) continue;
      score_.squared_error_coast_m2.add((track.position.v - truth.lights[i].position).squaredNorm());
    }
  }
}

}  // namespace mocap::eval
