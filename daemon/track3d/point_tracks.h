#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/expects.h"
#include "base/time.h"
#include "filter/point_filter.h"
#include "geometry/assignment.h"

namespace mocap::track3d {

/// How tracks are born, live and die. u is the unit of length: px in an image, m in the volume.
struct TrackLife {
  double gate_sigmas = 4.0;         ///< a sighting further from where it should be belongs to something else
  std::uint32_t confirm_sets = 3;   ///< consecutive sightings until a track is believed; 1: at once
  Duration max_coast{};             ///< unseen for longer, a track dies
  double clutter_density = 1.0;     ///< sightings of unknown points to reckon with, for each u^N
  double association_sigmas = 4.0;  ///< the gate of a sighting that others know to be the track's
  /// Known no better than that (standard deviation of an axis), an unseen track dies.
  double max_coast_sigma_u = std::numeric_limits<double>::infinity();
  /// Share of the sets in which a point does what nobody could foresee (it is hit, or an image is missing unnoticed);
  /// it is then `outlier_scale` times as far from where it should be as usual. 0: never.
  double outlier_probability = 0.0;
  double outlier_scale = 4.0;
};

/// The tracks of points in N dimensions, each with a filter F, and which of them each sighting of a set belongs to.
///
/// One set: `advance`, then `associate` for what others know, `assign` for the rest, `update`. Tracks are in the order
/// of their birth; ids are never used twice. All memory is taken in the constructor. One thread at a time.
template <class F, int N>
requires filter::PointFilter<F, N>
class PointTracks {
 public:
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  struct Track {
    F filter;
    filter::Gate<N> gate;  ///< at the time of the set
    std::uint32_t id = kNone;
    std::uint32_t age_sets = 1;
    std::uint32_t missed_sets = 0;
    std::uint32_t sighting = kNone;  ///< index in this set's sightings
    bool confirmed = false;
    Timestamp seen_at;
  };

  PointTracks(const TrackLife& life, std::size_t max_tracks, std::size_t max_sightings)
      : life_(life),
        max_tracks_(max_tracks),
        max_sightings_(max_sightings),
        assigner_(max_tracks, max_sightings, max_tracks * kMaxCandidates),
        outlier_cost_(-2.0 * std::log(life.outlier_probability) + 2.0 * N * std::log(life.outlier_scale)) {
    tracks_.reserve(max_tracks);
    taken_.reserve(max_sightings);
    placed_.reserve(max_sightings);
    rows_.reserve(max_tracks);
    pairs_.reserve(max_tracks * kMaxCandidates);
  }

  std::span<const Track> tracks() const { return tracks_; }
  std::span<Track> tracks() { return tracks_; }
  Timestamp at() const { return at_; }

  /// The track of that id, or null. `likely`: the index that it may have.
  Track* find(std::uint32_t id, std::size_t likely = 0) {
    if (likely < tracks_.size() && tracks_[likely].id == id) return &tracks_[likely];
    const auto found = std::lower_bound(tracks_.begin(), tracks_.end(), id,
                                        [](const Track& track, std::uint32_t value) { return track.id < value; });
    return found != tracks_.end() && found->id == id ? &*found : nullptr;
  }

  /// Whether a track has none of its life left, with that gate at that time.
  bool has_ended(const Track& track, const filter::Gate<N>& gate, Timestamp at) const {
    if (at - track.seen_at > life_.max_coast) return true;
    const double most_trace = N * life_.max_coast_sigma_u * life_.max_coast_sigma_u;
    return track.missed_sets > 0 && !(gate.covariance.trace() <= most_trace);
  }

  /// Moves all tracks on to `at`; those unseen for too long, or known too badly since, are gone. `sightings` will come.
  void advance(Timestamp at, std::size_t sightings) {
    MOCAP_EXPECTS(sightings <= max_sightings_);
    const double dt_s = tracks_.empty() ? 0.0 : std::max(0.0, to_s(at - at_));
    at_ = at;
    for (Track& track : tracks_) {
      track.filter.predict(dt_s);
      track.gate = track.filter.gate();
      track.sighting = kNone;
    }
    std::erase_if(tracks_, [&](const Track& track) { return has_ended(track, track.gate, at); });
    taken_.assign(sightings, 0);
  }

  /// Gives a sighting to a track, where it lies in the track's wider gate (`association_sigmas`) and the track has none
  /// that fits better. A sighting is claimed once at most. `surely`: wherever it lies.
  void associate(Track& track, std::span<const filter::Seen<N>> sightings, std::uint32_t index, bool surely = false) {
    const double most2 = life_.association_sigmas * life_.association_sigmas;
    if (!surely && !(track.gate.distance2(sightings[index]) <= most2)) return;
    if (track.sighting != kNone) {
      if (track.gate.fit(sightings[track.sighting]).cost <= track.gate.fit(sightings[index]).cost) return;
      taken_[track.sighting] = 0;
    }
    track.sighting = index;
    taken_[index] = 1;
  }

  /// Leaves a sighting out of this set altogether.
  void ignore(std::uint32_t index) { taken_[index] = 1; }

  /// Gives the sightings that are left to the tracks that are left, best in sum: those that are believed first, then
  /// the tentative ones.
  void assign(std::span<const filter::Seen<N>> sightings) {
    assign_to(true, sightings);
    assign_to(false, sightings);
  }

  /// Updates what was seen, lets coast what was not, and gives birth to a track for each sighting that nobody took;
  /// `make_filter` makes its filter. Over the bound sightings give no track.
  template <class MakeFilter>
  void update(std::span<const filter::Seen<N>> sightings, MakeFilter&& make_filter) {
    for (Track& track : tracks_) {
      ++track.age_sets;
      if (track.sighting == kNone) {
        ++track.missed_sets;
        track.filter.coast();
        continue;
      }
      track.filter.update(sightings[track.sighting]);
      track.missed_sets = 0;
      track.seen_at = at_;
      track.confirmed = track.confirmed || track.age_sets >= life_.confirm_sets;
    }
    std::erase_if(tracks_, [](const Track& track) { return !track.confirmed && track.missed_sets > 0; });
    for (std::uint32_t i = 0; i < sightings.size() && tracks_.size() < max_tracks_ && next_id_ != kNone; ++i) {
      if (taken_[i] != 0) continue;
      const F filter = make_filter(sightings[i]);
      tracks_.push_back({filter, filter.gate(), next_id_++, 1, 0, i, life_.confirm_sets <= 1, at_});
    }
  }

 private:
  // In a gate with more sightings than this the worst are not looked at.
  static constexpr std::size_t kMaxCandidates = 32;

  struct Placed {
    filter::Vector<N> point;
    std::uint32_t index;
  };

  void assign_to(bool confirmed, std::span<const filter::Seen<N>> sightings) {
    rows_.clear();
    for (std::uint32_t i = 0; i < tracks_.size(); ++i) {
      if (tracks_[i].sighting == kNone && tracks_[i].confirmed == confirmed) rows_.push_back(i);
    }
    placed_.clear();
    double max_variance = 0.0;
    for (std::uint32_t i = 0; i < sightings.size(); ++i) {
      if (taken_[i] != 0) continue;
      placed_.push_back({sightings[i].point, i});
      max_variance = std::max(max_variance, sightings[i].covariance.diagonal().maxCoeff());
    }
    if (rows_.empty() || placed_.empty()) return;
    sort_placed();
    pairs_.clear();
    for (std::uint32_t row = 0; row < rows_.size(); ++row) add_pairs(row, sightings, max_variance);
    // A point that goes unseen (one in ten is reckoned with) beside a sighting of something unknown.
    const double cost_of_alone = -2.0 * std::log(0.1 * life_.clutter_density);
    const auto columns = assigner_.assign(rows_.size(), sightings.size(), pairs_, cost_of_alone);
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      if (columns[row] == geometry::Assigner::kAlone) continue;
      tracks_[rows_[row]].sighting = columns[row];
      taken_[columns[row]] = 1;
    }
  }

  // Along the axis on which they lie farthest apart: there the fewest are near a track.
  void sort_placed() {
    filter::Vector<N> least = placed_.front().point, most = least;
    for (const Placed& placed : placed_) {
      least = least.cwiseMin(placed.point);
      most = most.cwiseMax(placed.point);
    }
    (most - least).maxCoeff(&axis_);
    std::ranges::sort(placed_, [axis = axis_](const Placed& a, const Placed& b) {
      return a.point[axis] != b.point[axis] ? a.point[axis] < b.point[axis] : a.index < b.index;
    });
  }

  // What a sighting costs a track that may be surprised: the likelier of both tails. Infinite outside of the gate.
  double cost_of(const typename filter::Gate<N>::Fit& fit, bool may_be_outlier) const {
    const double gate2 = life_.gate_sigmas * life_.gate_sigmas;
    const double infinite = std::numeric_limits<double>::infinity();
    const double usual = fit.distance2 <= gate2 ? fit.cost : infinite;
    const double scale2 = life_.outlier_scale * life_.outlier_scale;
    if (!may_be_outlier || !(fit.distance2 <= gate2 * scale2)) return usual;
    const double surprise = fit.cost - fit.distance2 + fit.distance2 / scale2 + outlier_cost_;
    return std::min(usual, surprise);
  }

  void add_pairs(std::uint32_t row, std::span<const filter::Seen<N>> sightings, double max_variance) {
    const Track& track = tracks_[rows_[row]];
    const filter::Gate<N>& gate = track.gate;
    const bool may_be_outlier = life_.outlier_probability > 0.0 && track.confirmed && track.missed_sets == 0;
    const double sigmas = life_.gate_sigmas * (may_be_outlier ? life_.outlier_scale : 1.0);
    const filter::Vector<N> reach = gate.reach(sigmas, max_variance);
    const std::size_t first_pair = pairs_.size();
    const double first = gate.centre[axis_] - reach[axis_], last = gate.centre[axis_] + reach[axis_];
    auto near = std::lower_bound(placed_.begin(), placed_.end(), first,
                                 [this](const Placed& placed, double at) { return placed.point[axis_] < at; });
    for (; near != placed_.end() && near->point[axis_] <= last; ++near) {
      if (((near->point - gate.centre).array().abs() > reach.array()).any()) continue;
      const filter::Seen<N>& seen = sightings[near->index];
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
  std::size_t max_sightings_;
  geometry::Assigner assigner_;
  double outlier_cost_;  // beside what the distance costs
  std::vector<Track> tracks_;
  Timestamp at_;
  std::uint32_t next_id_ = 0;
  std::vector<std::uint8_t> taken_;  // of each sighting of this set
  std::vector<Placed> placed_;       // those that nobody took, along an axis
  Eigen::Index axis_ = 0;
  std::vector<std::uint32_t> rows_;  // tracks that are being assigned
  std::vector<geometry::AllowedPair> pairs_;
};

}  // namespace mocap::track3d
