#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/expects.h"
#include "base/time.h"
#include "filter/point_filter.h"
#include "geometry/assignment.h"
#include "model/camera_bits.h"

namespace mocap::track3d {

/// Parameters of track initiation, association and termination. u is the unit of length: px in an image, m in the
/// volume.
struct TrackLife {
  double gate_sigmas = 4.0;         ///< gate of the association, in standard deviations
  std::uint32_t confirm_sets = 3;   ///< consecutive measurements until a track is confirmed; 1: at once
  Duration max_coast{};             ///< a track that is unobserved for longer ends
  double clutter_density = 1.0;     ///< measurements of unknown points, per u^N
  double association_sigmas = 4.0;  ///< gate of associate()
  /// An unobserved track with a larger standard deviation (of an axis) ends.
  double max_coast_sigma_u = std::numeric_limits<double>::infinity();
  /// Share of the sets in which a point moves unlike the motion model; the innovation is then `outlier_scale` times as
  /// large (a mixture of two Gaussians). 0: never.
  double outlier_probability = 0.0;
  double outlier_scale = 4.0;
};

/// Multi-target tracker of points in N dimensions with a filter F for each track and global nearest neighbour
/// association (Bar-Shalom and Fortmann 1988), solved exactly (geometry::Assigner).
///
/// For each set: `advance`, then `associate` for known associations, `assign` for the rest, `update`. Tracks are in the
/// order of their initiation; an id is never used twice. Allocates in the constructor only. One thread makes all calls.
template <class F, int N>
requires filter::PointFilter<F, N>
class PointTracks {
 public:
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  struct Track {
    F filter;
    filter::Gate<N> gate;  ///< predicted for the current set
    std::uint32_t id = kNone;
    std::uint32_t age_sets = 1;
    std::uint32_t missed_sets = 0;      ///< since the last measurement; only sets that could measure the point
    std::uint32_t measurement = kNone;  ///< index in the measurements of the current set
    bool confirmed = false;
    Timestamp seen_at;
    bool coasts = false;     ///< was not measured in the last set
    bool measurable = true;  ///< the current set could measure the point; `advance` sets it to true
    CameraBits seen_by = 0;  ///< the cameras of the last measurement, if they are known

    void archive(Archive& members) {
      members(filter, gate, id, age_sets, missed_sets, measurement, confirmed, seen_at, coasts, measurable, seen_by);
    }
  };

  /// The ids ascend from `first_id`.
  PointTracks(const TrackLife& life, std::size_t max_tracks, std::size_t max_measurements, std::uint32_t first_id = 0)
      : life_(life),
        max_tracks_(max_tracks),
        max_measurements_(max_measurements),
        assigner_(max_tracks, max_measurements, max_tracks * kMaxCandidates),
        outlier_cost_(-2.0 * std::log(life.outlier_probability) + 2.0 * N * std::log(life.outlier_scale)),
        next_id_(first_id) {
    tracks_.reserve(max_tracks);
    is_assigned_.reserve(max_measurements);
    sorted_.reserve(max_measurements);
    rows_.reserve(max_tracks);
    pairs_.reserve(max_tracks * kMaxCandidates);
  }

  /// Takes over the tracks of a tracker with the same bounds.
  void adopt(PointTracks& before) {
    MOCAP_EXPECTS(before.max_tracks_ == max_tracks_);
    tracks_.swap(before.tracks_);
    at_ = before.at_;
    continue_ids(before);
  }
  /// No id of `before` is used again.
  void continue_ids(const PointTracks& before) { next_id_ = std::max(next_id_, before.next_id_); }

  /// Writes the tracks, or takes them over from a tracker with the same bounds. `filter`: any filter, which the tracks
  /// that are read replace.
  void archive(Archive& members, const F& filter) {
    const std::size_t count = members.count(tracks_.size(), max_tracks_);
    if (members.is_reading() && members.ok())
      tracks_.assign(count, Track{.filter = filter, .gate = filter.gate(), .seen_at = {}});
    for (Track& track : tracks_) members(track);
    members(at_, next_id_);
  }

  std::span<const Track> tracks() const { return tracks_; }
  std::span<Track> tracks() { return tracks_; }
  Timestamp at() const { return at_; }

  /// The track with this id, or null. `likely`: the index that is tried first.
  Track* find(std::uint32_t id, std::size_t likely = 0) {
    if (likely < tracks_.size() && tracks_[likely].id == id) return &tracks_[likely];
    const auto found = std::lower_bound(tracks_.begin(), tracks_.end(), id,
                                        [](const Track& track, std::uint32_t value) { return track.id < value; });
    return found != tracks_.end() && found->id == id ? &*found : nullptr;
  }

  /// Whether a track ends at `at`, where it has this gate.
  bool has_ended(const Track& track, const filter::Gate<N>& gate, Timestamp at) const {
    if (at - track.seen_at > life_.max_coast) return true;
    const double most_trace = N * life_.max_coast_sigma_u * life_.max_coast_sigma_u;
    return track.coasts && !(gate.predicted_covariance.trace() <= most_trace);
  }

  /// Advances all tracks to `at` and removes those that end. `measurements`: number of measurements of the set.
  void advance(Timestamp at, std::size_t measurements) {
    MOCAP_EXPECTS(measurements <= max_measurements_);
    const double dt_s = tracks_.empty() ? 0.0 : std::max(0.0, to_s(at - at_));
    at_ = at;
    for (Track& track : tracks_) {
      track.filter.predict(dt_s);
      track.gate = track.filter.gate();
      track.measurement = kNone;
      track.measurable = true;
    }
    std::erase_if(tracks_, [&](const Track& track) { return has_ended(track, track.gate, at); });
    is_assigned_.assign(measurements, 0);
  }

  /// Assigns a measurement to a track if it lies inside the gate of `association_sigmas` and the track has no
  /// measurement that fits better. A measurement is associated at most once. `surely`: without a gate.
  void associate(Track& track, std::span<const filter::Seen<N>> measurements, std::uint32_t index,
                 bool surely = false) {
    const double most2 = life_.association_sigmas * life_.association_sigmas;
    if (!surely && !(track.gate.distance2(measurements[index]) <= most2)) return;
    if (track.measurement != kNone) {
      if (track.gate.fit(measurements[track.measurement]).cost <= track.gate.fit(measurements[index]).cost) return;
      is_assigned_[track.measurement] = 0;
    }
    track.measurement = index;
    is_assigned_[index] = 1;
  }

  /// Excludes a measurement from this set.
  void ignore(std::uint32_t index) { is_assigned_[index] = 1; }

  /// Assigns the remaining measurements to the remaining tracks with the least total cost: confirmed tracks first, then
  /// tentative ones.
  void assign(std::span<const filter::Seen<N>> measurements) {
    assign_to(true, measurements);
    assign_to(false, measurements);
  }

  /// Updates the observed tracks, lets the others coast (those that are `measurable` have missed a set), and initiates
  /// a track for each unassigned measurement with the filter of `make_filter`. At the bound no track is initiated.
  template <class MakeFilter>
  void update(std::span<const filter::Seen<N>> measurements, MakeFilter&& make_filter) {
    for (Track& track : tracks_) {
      ++track.age_sets;
      track.coasts = track.measurement == kNone;
      if (track.coasts) {
        if (track.measurable) ++track.missed_sets;
        track.filter.coast();
        continue;
      }
      track.filter.update(measurements[track.measurement]);
      track.missed_sets = 0;
      track.seen_at = at_;
      track.confirmed = track.confirmed || track.age_sets >= life_.confirm_sets;
    }
    std::erase_if(tracks_, [](const Track& track) { return !track.confirmed && track.missed_sets > 0; });
    for (std::uint32_t i = 0; i < measurements.size() && tracks_.size() < max_tracks_ && next_id_ != kNone; ++i) {
      if (is_assigned_[i] != 0) continue;
      const F filter = make_filter(measurements[i]);
      tracks_.push_back({.filter = filter,
                         .gate = filter.gate(),
                         .id = next_id_++,
                         .measurement = i,
                         .confirmed = life_.confirm_sets <= 1,
                         .seen_at = at_});
    }
  }

 private:
  // Bound on the measurements in one gate; those of the highest cost are omitted.
  static constexpr std::size_t kMaxCandidates = 32;

  struct SortedMeasurement {
    filter::Vector<N> point;
    std::uint32_t index;
  };

  void assign_to(bool confirmed, std::span<const filter::Seen<N>> measurements) {
    rows_.clear();
    for (std::uint32_t i = 0; i < tracks_.size(); ++i) {
      if (tracks_[i].measurement == kNone && tracks_[i].confirmed == confirmed) rows_.push_back(i);
    }
    sorted_.clear();
    double max_variance = 0.0;
    for (std::uint32_t i = 0; i < measurements.size(); ++i) {
      if (is_assigned_[i] != 0) continue;
      sorted_.push_back({measurements[i].point, i});
      max_variance = std::max(max_variance, measurements[i].covariance.diagonal().maxCoeff());
    }
    if (rows_.empty() || sorted_.empty()) return;
    sort_measurements();
    pairs_.clear();
    for (std::uint32_t row = 0; row < rows_.size(); ++row) add_pairs(row, measurements, max_variance);
    // Cost of a missed detection (probability 0.1, chosen by hand) and one clutter measurement.
    const double cost_of_unassigned = -2.0 * std::log(0.1 * life_.clutter_density);
    const auto columns = assigner_.assign(rows_.size(), measurements.size(), pairs_, cost_of_unassigned);
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      if (columns[row] == geometry::Assigner::kUnassigned) continue;
      tracks_[rows_[row]].measurement = columns[row];
      is_assigned_[columns[row]] = 1;
    }
  }

  // Sorts along the axis of the largest extent: there the fewest measurements are near a track.
  void sort_measurements() {
    filter::Vector<N> least = sorted_.front().point, most = least;
    for (const SortedMeasurement& one : sorted_) {
      least = least.cwiseMin(one.point);
      most = most.cwiseMax(one.point);
    }
    (most - least).maxCoeff(&axis_);
    std::ranges::sort(sorted_, [axis = axis_](const SortedMeasurement& a, const SortedMeasurement& b) {
      return a.point[axis] != b.point[axis] ? a.point[axis] < b.point[axis] : a.index < b.index;
    });
  }

  // The cost of a measurement: the cheaper of the usual and the outlier hypothesis. Infinite outside the gate.
  double cost_of(const typename filter::Gate<N>::Fit& fit, bool may_be_outlier) const {
    const double gate2 = life_.gate_sigmas * life_.gate_sigmas;
    const double infinite = std::numeric_limits<double>::infinity();
    const double usual = fit.distance2 <= gate2 ? fit.cost : infinite;
    const double scale2 = life_.outlier_scale * life_.outlier_scale;
    if (!may_be_outlier || !(fit.distance2 <= gate2 * scale2)) return usual;
    const double outlier = fit.cost - fit.distance2 + fit.distance2 / scale2 + outlier_cost_;
    return std::min(usual, outlier);
  }

  void add_pairs(std::uint32_t row, std::span<const filter::Seen<N>> measurements, double max_variance) {
    const Track& track = tracks_[rows_[row]];
    const filter::Gate<N>& gate = track.gate;
    const bool may_be_outlier = life_.outlier_probability > 0.0 && track.confirmed && !track.coasts;
    const double sigmas = life_.gate_sigmas * (may_be_outlier ? life_.outlier_scale : 1.0);
    const filter::Vector<N> reach = gate.reach(sigmas, max_variance);
    const std::size_t first_pair = pairs_.size();
    const double first = gate.centre[axis_] - reach[axis_], last = gate.centre[axis_] + reach[axis_];
    auto near = std::lower_bound(sorted_.begin(), sorted_.end(), first,
                                 [this](const SortedMeasurement& one, double at) { return one.point[axis_] < at; });
    for (; near != sorted_.end() && near->point[axis_] <= last; ++near) {
      if (((near->point - gate.centre).array().abs() > reach.array()).any()) continue;
      const filter::Seen<N>& seen = measurements[near->index];
      const double cost = cost_of(gate.fit(seen), may_be_outlier);
      if (!std::isfinite(cost)) continue;
      const geometry::AllowedPair pair{row, near->index, cost};
      if (pairs_.size() - first_pair < kMaxCandidates) {
        pairs_.push_back(pair);
        continue;
      }
      const auto worst = std::max_element(pairs_.begin() + static_cast<std::ptrdiff_t>(first_pair), pairs_.end(),
                                          [](const auto& a, const auto& b) { return a.cost < b.cost; });
      if (pair.cost < worst->cost) *worst = pair;
    }
  }

  TrackLife life_;
  std::size_t max_tracks_;
  std::size_t max_measurements_;
  geometry::Assigner assigner_;
  double outlier_cost_;  // added to the cost of the scaled distance
  std::vector<Track> tracks_;
  Timestamp at_;
  std::uint32_t next_id_;
  std::vector<std::uint8_t> is_assigned_;  // by measurement: 1 if assigned or excluded
  std::vector<SortedMeasurement> sorted_;  // unassigned measurements, sorted along axis_
  Eigen::Index axis_ = 0;
  std::vector<std::uint32_t> rows_;  // tracks of the assignment problem
  std::vector<geometry::AllowedPair> pairs_;
};

}  // namespace mocap::track3d
