#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "geometry/assignment.h"
#include "lib/simworld/points_world.h"
#include "model/sighting.h"

namespace mocap::eval {

/// A counted share.
struct Share {
  std::uint64_t found = 0;
  std::uint64_t of = 0;

  double value() const { return of == 0 ? 1.0 : static_cast<double>(found) / static_cast<double>(of); }
  void count(bool was_found) {
    ++of;
    found += was_found ? 1 : 0;
  }
};

/// A sum over points, for a mean.
struct Sum {
  double total = 0.0;
  std::uint64_t count = 0;

  double mean() const { return count == 0 ? 0.0 : total / static_cast<double>(count); }
  void add(double value) {
    total += value;
    ++count;
  }
};

/// Figures of the 3D points and tracks over all sets and seeds.
struct PointsScore {
  std::uint64_t sets = 0;
  std::uint64_t views = 0;   ///< views of lights; a merged blob counts for each of its lights
  std::uint64_t lights = 0;  ///< present lights, summed over the sets
  Sum squared_error_m2;      ///< of points whose views all have a blob of the light alone
  Sum bound_m2;              ///< Cramer-Rao bound of the variance with these views
  Sum nees;
  Sum squared_error_merged_m2;  ///< of the other points
  Sum squared_error_track_m2;   ///< of the confirmed tracks of the points in squared_error_m2
  Sum nees_track;
  Sum squared_error_coast_m2;  ///< of coasting tracks, against their last light
  Share seen_by_3plus, seen_by_2_known, seen_by_2_new, merged;
  Share tracked;                         ///< lights with at least two views that have a confirmed track
  std::uint64_t point_ghosts = 0;        ///< triangulated points without a light
  std::uint64_t ghosts = 0;              ///< confirmed tracks, measured in the set, without a light
  std::uint64_t id_changes = 0;          ///< a light has a different track than when it was last tracked
  std::uint64_t id_changes_named = 0;    ///< changes of lights that have a label in the recording
  std::uint64_t id_changes_in_view = 0;  ///< changes from one set to the next
  std::uint64_t initiated = 0;           ///< initiated tracks
  std::uint64_t skipped = 0;             ///< hypotheses of new markers that were skipped to bound the work
};

/// Compares the results of the steps with the truth, set by set.
class PointsScorer {
 public:
  /// `rig` and `score` must outlive the scorer. Use a new scorer for each run, because it retains the tracks of the
  /// lights.
  PointsScorer(const Rig& rig, double noise_px, PointsScore& score);

  void add(const simworld::SeenInstant& truth, const Matches& matches, const Markers& markers,
           const Predictions& expected, const TrackedMarkers& tracked);

  /// Confirmed tracks, measured in the last set, without a light.
  const std::vector<const TrackedMarker*>& ghosts() const { return ghosts_; }
  /// Lights without a triangulated point in the last set, although exactly two cameras see them and a track predicts
  /// them.
  const std::vector<std::size_t>& missed() const { return missed_; }
  /// The current or last track of a light.
  std::uint32_t last_track(std::size_t light) const { return last_track_[light]; }

 private:
  struct Bound {
    bool observable = false;  ///< the views determine the position
    Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
    double gate_m = 0.0;  ///< an output farther away is not this light
  };

  void find_bounds(const simworld::SeenInstant& truth);
  Bound bound_of(const Eigen::Vector3d& light, std::uint64_t cameras) const;
  void pair_up(const simworld::SeenInstant& truth, const std::vector<Eigen::Vector3d>& places);
  void score_points(const simworld::SeenInstant& truth, const Markers& markers, const Predictions& expected);
  void score_tracks(const simworld::SeenInstant& truth, const TrackedMarkers& tracked);
  bool is_known(std::size_t light, const Eigen::Vector3d& place, const Predictions& expected) const;

  const Rig& rig_;
  double noise_px_;
  PointsScore& score_;
  std::vector<Bound> bounds_;              // by light
  std::vector<std::uint32_t> place_of_;    // by light: index of the assigned output, or kUnassigned
  std::vector<std::uint32_t> last_track_;  // by light
  std::vector<std::uint64_t> last_set_;    // by light: number of the set with that track
  std::vector<const TrackedMarker*> ghosts_;
  std::vector<std::size_t> missed_;
  std::uint64_t set_ = 0;
  std::uint32_t next_track_ = 0;
  std::vector<geometry::AllowedPair> pairs_;
  geometry::Assigner assigner_;
};

/// The figures as one JSON object or as text.
std::string to_json(const PointsScore& score, const std::string& motion, const simworld::WorldSettings& settings,
                    int seeds);
std::string to_text(const PointsScore& score);

}  // namespace mocap::eval
