#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "model/camera_model.h"
#include "module/matcher.h"

namespace mocap::associate {

struct MatchSettings {
  double gate_sigmas = 4.0;    ///< an expected marker's blob may lie that many standard deviations off
  double gate_floor_px = 1.0;  ///< standard deviation added to what expectation and blob promise
  /// Standard deviation of what the rig may be wrong, added to each blob's own. Views of expected markers may be off by
  /// less, once they have shown that they are better.
  double calibration_px = 0.5;
  double agree_sigmas = 3.5;        ///< the views of one marker lie no farther than that from their common point
  std::uint32_t min_views_new = 3;  ///< of a marker nobody expects; 2 where only two cameras could see it
  double min_ray_angle_deg = 2.0;   ///< two views closer to parallel than that tell no depth
  Eigen::Vector3d volume_min_m{-20.0, -20.0, -1.0};  ///< no marker outside of this box
  Eigen::Vector3d volume_max_m{20.0, 20.0, 10.0};

  bool in_volume(const Eigen::Vector3d& point) const {
    return (point.array() >= volume_min_m.array()).all() && (point.array() <= volume_max_m.array()).all();
  }
};

/// A Matcher: the expected markers first, the rest by epipolar geometry.
///
/// Known: each expected place is projected with its covariance into each view; in each view all expected markers are
/// assigned to blobs at once, exactly; the views of a marker must then agree on one point, or the odd one is left out.
/// Two views are enough. One view alone is left free, counted in Matches::seen_once, and told in Matches::lone where
/// no new marker needs its blob.
///
/// New: two blobs near each other's epipolar lines and rays that meet inside the volume make a hypothesis; the other
/// views support it or not; the best (most views, then least error) take their blobs first. Of two-view hypotheses
/// that share a blob none is believed. The work for one set is bounded; what was left untried is counted in
/// Matches::skipped. Of more than 16 cameras not all pairs are asked in every set, but all within a few.
///
/// Blobs are told by Blob::centroid and sigma_px. Cameras of the sets index `rig`. Never allocates after construction.
std::unique_ptr<Matcher> make_matcher(const MatchSettings& settings, Rig rig);

}  // namespace mocap::associate
