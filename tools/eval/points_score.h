#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "geometry/assignment.h"
#include "lib/simworld/points_world.h"
#include "model/sighting.h"

namespace mocap::eval {

/// Found of how many.
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

/// What became of the points, over all sets and seeds.
struct PointsScore {
  std::uint64_t sets = 0;
  std::uint64_t views = 0;   ///< blobs of lights, merged ones counted for each
  std::uint64_t lights = 0;  ///< that were there, over the sets
  Sum squared_error_m2;      ///< of points all of whose views have a blob of it alone
  Sum bound_m2;              ///< the least variance that these views allow
  Sum nees;
  Sum squared_error_merged_m2;  ///< of the other points
  Sum squared_error_track_m2;   ///< of the confirmed tracks of the points in squared_error_m2
  Sum nees_track;
  Sum squared_error_coast_m2;  ///< of tracks that coast, from the light that they bore
  Share seen_by_3plus, seen_by_2_known, seen_by_2_new, merged;
  Share tracked;                         ///< lights with two views or more that a confirmed track bears
  std::uint64_t point_ghosts = 0;        ///< triangulated where no light is
  std::uint64_t ghosts = 0;              ///< confirmed tracks, seen in the set, where no light is
  std::uint64_t id_changes = 0;          ///< a light bears another track than when it was last tracked
  std::uint64_t id_changes_named = 0;    ///< of these, lights that have a name in the recording
  std::uint64_t id_changes_in_view = 0;  ///< of these, from one set to the next
  std::uint64_t births = 0;              ///< tracks
  std::uint64_t skipped = 0;             ///< hypotheses of new markers left untried for want of time
};

/// Compares what the stages say with the truth, set by set.
class PointsScorer {
 public:
  /// `rig` outlives it. A new scorer for each run: it remembers who was who.
  PointsScorer(const Rig& rig, double noise_px, PointsScore& score);

  void add(const simworld::SeenInstant& truth, const Matches& matches, const Markers& markers, const Expected& expected,
           const TrackedMarkers& tracked);

  /// Confirmed tracks, seen in the last set, where no light is.
  const std::vector<const TrackedMarker*>& ghosts() const { return ghosts_; }
  /// Lights that exactly two cameras see and a track foretold, in the last set, of which there is no point.
  const std::vector<std::size_t>& missed() const { return missed_; }
  /// The track that bears or bore a light last.
  std::uint32_t last_track(std::size_t light) const { return last_track_[light]; }

 private:
  struct Bound {
    bool told = false;  ///< two views or more, that tell depth
    Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
    double gate_m = 0.0;  ///< farther off is not this light
  };

  void find_bounds(const simworld::SeenInstant& truth);
  Bound bound_of(const Eigen::Vector3d& light, std::uint64_t cameras) const;
  void pair_up(const simworld::SeenInstant& truth, const std::vector<Eigen::Vector3d>& places);
  void score_points(const simworld::SeenInstant& truth, const Markers& markers, const Expected& expected);
  void score_tracks(const simworld::SeenInstant& truth, const TrackedMarkers& tracked);
  bool is_known(std::size_t light, const Eigen::Vector3d& place, const Expected& expected) const;

  const Rig& rig_;
  double noise_px_;
  PointsScore& score_;
  std::vector<Bound> bounds_;              // by light
  std::vector<std::uint32_t> place_of_;    // by light: the output that it is, or kAlone
  std::vector<std::uint32_t> last_track_;  // by light
  std::vector<std::uint64_t> last_set_;    // by light: when it bore that
  std::vector<const TrackedMarker*> ghosts_;
  std::vector<std::size_t> missed_;
  std::uint64_t set_ = 0;
  std::uint32_t next_track_ = 0;
  std::vector<geometry::AllowedPair> pairs_;
  geometry::Assigner assigner_;
};

/// The figures as one JSON object, or as a table for people.
std::string to_json(const PointsScore& score, const std::string& motion, const simworld::WorldSettings& settings,
                    int seeds);
std::string to_text(const PointsScore& score);

}  // namespace mocap::eval
