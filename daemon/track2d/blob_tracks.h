#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/time.h"
#include "filter/isotropic_kalman.h"
#include "geometry/assignment.h"
#include "geometry/disc_shapes.h"
#include "model/blob.h"
#include "track2d/assignment_ambiguity.h"
#include "track2d/blob_grid.h"
#include "track2d/blob_pair.h"

namespace mocap::track2d {

/// Track initiation and deletion.
struct BlobTrackLife {
  std::uint32_t confirm_images = 3;  ///< consecutive measurements until a track is confirmed; 1: at once
  Duration max_coast{};              ///< a track without a measurement for longer is deleted
};

/// The predicted measurement of a track.
struct BlobAim {
  filter::Vector<2> centre_px;
  double variance_px2;  ///< of the predicted position, each axis, without the blob's own variance
  double reach_px;      ///< radius of the gate
};

/// The tracks of one camera's blobs. Each track has a motion filter F with
///
///   predict(dt_s), aim() -> BlobAim, update(point, variance), coast(),
///   kalman() -> IsotropicKalman<2> and restart(IsotropicKalman<2>), which pass the state to a BlobPair and back
///
/// Tracks are in the order of initiation; an id is never used twice. Blobs are assigned to tracks with the least sum of
/// costs over all pairs within the gates (global nearest neighbour; at most the 32 likeliest blobs of a gate),
/// confirmed tracks first. A confirmed track ends, and its blob initiates another one, if other assignments are nearly
/// as likely: after a gap between two images, the markers may have exchanged their places. Two confirmed tracks become
/// a BlobPair if one blob could belong to both: their markers' discs overlap in the image, or the costs do not favour
/// either clearly.
///
/// Thread: one. Allocates in the constructor only.
///
/// Source: Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation (2001).
template <class F>
class BlobTracks {
 public:
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  struct Track {
    F follower;
    BlobAim aim;
    std::uint32_t id = kNone;
    std::uint32_t age_images = 1;
    std::uint32_t missed_images = 0;
    std::uint32_t blob = kNone;  ///< index in the image; two tracks that share a merged blob both have its index
    std::uint32_t pair = kNone;  ///< index of the track's pair
    bool confirmed = false;
    bool sure = true;         ///< the blob belongs to this track alone, without ambiguity
    bool is_updated = false;  ///< the filter has been updated with this image
    bool ambiguous = false;   ///< in this image, another assignment is nearly as likely
    double area_px2 = 0.0;
    Timestamp seen_at{};
  };

  BlobTracks(const BlobTrackLife& life, std::size_t max_blobs)
      : life_(life),
        max_tracks_(2 * max_blobs),
        grid_(max_blobs),
        assigner_(max_tracks_, max_blobs, max_tracks_ * kMaxCandidates),
        ambiguity_(max_tracks_, max_blobs) {
    tracks_.reserve(max_tracks_);
    lost_.reserve(max_tracks_);
    pairs_.reserve(kMaxPairs);
    entries_.reserve(max_blobs);
    variance_.reserve(max_blobs);
    owner_.reserve(max_blobs);
    rows_.reserve(max_tracks_);
    candidates_.reserve(max_tracks_ * kMaxCandidates);
  }

  std::span<const Track> tracks() const { return tracks_; }
  std::span<const BlobPair> pairs() const { return pairs_; }

  struct Lost {
    std::uint32_t id;
    filter::Vector<2> expected_px;
  };
  /// The confirmed tracks that ended in the last image.
  std::span<const Lost> lost() const { return lost_; }
  Timestamp at() const { return at_; }

  /// Processes one image. `make_follower(point, variance)` makes the filter of a new track.
  template <class MakeFilter>
  void step(Timestamp at, std::span<const Blob> blobs, MakeFilter&& make_follower) {
    const double dt_s = tracks_.empty() ? 0.0 : std::max(0.0, to_s(at - at_));
    at_ = at;
    predict(dt_s);
    index_blobs(blobs);
    assign(true);
    assign(false);
    end_ambiguous();
    find_pairs(blobs);
    update_pairs(blobs);
    update_tracks(blobs);
    initiate_tracks(blobs, make_follower);
  }

 private:
  // A gate with more blobs than this keeps the likeliest.
  static constexpr std::size_t kMaxCandidates = 32;
  static constexpr std::size_t kMaxPairs = 32;
  // -2 ln of the probability of a missed detection (one image in 100) and a clutter blob (one in ten images, uniform
  // over a small image): less likely than any manoeuvre within the gate.
  static constexpr double kUnassignedCost = 33.0;
  // -2 ln of the probability that a marker that was hidden in the last image reappears: 1 in 20.
  static constexpr double kReappearanceCost = 6.0;
  // Odds of 20 to 1: with less, the blob's assignment is ambiguous.
  static constexpr double kAmbiguityCost = 6.0;
  // A pair ends at odds of 100 to 1, or after this many images with separate blobs: motion then decides no more.
  static constexpr double kPairDecisionCost = 9.2;
  static constexpr std::uint32_t kMaxImagesApart = 8;
  // Lower bound of a centroid's standard deviation: lens model, marker shape, motion blur.
  static constexpr double kMinSigma_px = 0.02;
  // Weight of the newest blob in the running mean of a track's area, if the areas are similar.
  static constexpr double kAreaRate = 0.2;
  // A blob with less than this share of the track's area is partly occluded.
  static constexpr double kOccludedAreaRatio = 0.95;
  // A blob with more than this share of the track's area is merged with another marker's blob.
  static constexpr double kMergedAreaRatio = 1.1;

  void predict(double dt_s) {
    for (BlobPair& pair : pairs_) pair.predict(dt_s);
    for (Track& track : tracks_) {
      track.follower.predict(dt_s);
      track.aim = track.follower.aim();
      track.blob = kNone;
      track.sure = true;
      track.is_updated = false;
      track.ambiguous = false;
    }
    lost_.clear();
    const auto ended = [this](const Track& track) { return at_ - track.seen_at > life_.max_coast; };
    for (const Track& track : tracks_) {
      if (track.confirmed && ended(track)) lost_.push_back({track.id, track.aim.centre_px});
    }
    erase_if(ended);
  }

  /// Deletes tracks, and the pairs that contain them.
  template <class Is>
  void erase_if(Is&& is) {
    if (std::none_of(tracks_.begin(), tracks_.end(), is)) return;
    for (std::size_t p = pairs_.size(); p-- > 0;) {
      if (is(tracks_[pairs_[p].member(0).track]) || is(tracks_[pairs_[p].member(1).track])) dissolve(p);
    }
    std::size_t write = 0;
    for (std::size_t i = 0; i < tracks_.size(); ++i) {
      if (is(tracks_[i])) continue;
      if (const std::uint32_t pair = tracks_[i].pair; pair != kNone) {
        for (const std::size_t m : {std::size_t{0}, std::size_t{1}}) {
          if (pairs_[pair].member(m).track == i) pairs_[pair].member(m).track = static_cast<std::uint32_t>(write);
        }
      }
      if (write != i) tracks_[write] = tracks_[i];
      ++write;
    }
    tracks_.erase(tracks_.begin() + static_cast<std::ptrdiff_t>(write), tracks_.end());
  }

  void index_blobs(std::span<const Blob> blobs) {
    entries_.clear();
    variance_.clear();
    for (std::uint32_t i = 0; i < blobs.size(); ++i) {
      const double sigma = std::max(blobs[i].sigma_px, kMinSigma_px);
      variance_.push_back(sigma * sigma);
      const filter::Vector<2>& point = blobs[i].centroid.v;
      if (std::isfinite(point.x() + point.y() + sigma)) entries_.push_back({point.x(), point.y(), i});
    }
    owner_.assign(blobs.size(), kNone);
    grid_.build(entries_);
  }

  void assign(bool confirmed) {
    rows_.clear();
    candidates_.clear();
    for (std::uint32_t i = 0; i < tracks_.size(); ++i) {
      if (tracks_[i].confirmed != confirmed) continue;
      add_candidates(static_cast<std::uint32_t>(rows_.size()), tracks_[i]);
      rows_.push_back(i);
    }
    if (candidates_.empty()) return;
    const auto columns = assigner_.assign(rows_.size(), variance_.size(), candidates_, kUnassignedCost);
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      if (columns[row] == geometry::Assigner::kUnassigned) continue;
      tracks_[rows_[row]].blob = columns[row];
      owner_[columns[row]] = rows_[row];
    }
    if (!confirmed) return;
    const auto ambiguous = ambiguity_.find(candidates_, columns, variance_.size(), kUnassignedCost, kAmbiguityCost);
    for (std::size_t row = 0; row < rows_.size(); ++row) tracks_[rows_[row]].ambiguous = ambiguous[row] != 0;
  }

  /// Ends the ambiguous tracks; their blobs initiate new ones. Members of a pair have hypotheses of their own.
  void end_ambiguous() {
    for (Track& track : tracks_) {
      if (!track.ambiguous || track.pair != kNone) continue;
      lost_.push_back({track.id, track.aim.centre_px});
      owner_[track.blob] = kNone;
      track.blob = kNone;
      track.confirmed = false;
    }
  }

  /// Cost of assigning a blob to the track: -2 ln of the likelihood.
  double cost_of(const Track& track, std::uint32_t blob, double distance2) const {
    const double cost = filter::innovation_cost<2>(distance2, track.aim.variance_px2 + variance_[blob]);
    return track.missed_images > 0 ? cost + kReappearanceCost : cost;
  }

  void add_candidates(std::uint32_t row, const Track& track) {
    const BlobAim& aim = track.aim;
    const std::size_t first = candidates_.size();
    grid_.for_each_near(aim.centre_px, aim.reach_px, [&](std::uint32_t blob, double distance2) {
      if (owner_[blob] != kNone) return;
      const double cost = cost_of(track, blob, distance2);
      if (candidates_.size() - first < kMaxCandidates) {
        candidates_.push_back({row, blob, cost});
        return;
      }
      const auto worst = std::max_element(candidates_.begin() + static_cast<std::ptrdiff_t>(first), candidates_.end(),
                                          [](const auto& a, const auto& b) { return a.cost < b.cost; });
      if (cost < worst->cost) *worst = {row, blob, cost};
    });
  }

  /// Finds, for each confirmed track without a blob, an assigned blob that the track could share with its owner or take
  /// over.
  void find_pairs(std::span<const Blob> blobs) {
    for (std::uint32_t i = 0; i < tracks_.size(); ++i) {
      const Track& track = tracks_[i];
      if (!track.confirmed || track.blob != kNone || track.pair != kNone) continue;
      std::uint32_t with = kNone;
      double least = std::numeric_limits<double>::infinity();
      grid_.for_each_near(track.aim.centre_px, track.aim.reach_px, [&](std::uint32_t blob, double distance2) {
        const std::uint32_t owner = owner_[blob];
        if (owner == kNone || !tracks_[owner].confirmed || !can_join_pair(tracks_[owner])) return;
        const double cost = cost_of(track, blob, distance2);
        if (cost >= least || !may_merge(track, tracks_[owner], blobs[blob], cost, distance2)) return;
        least = cost;
        with = owner;
      });
      if (with == kNone) continue;
      if (tracks_[with].pair != kNone) dissolve(tracks_[with].pair);
      if (pairs_.size() == kMaxPairs) continue;
      pairs_.push_back(BlobPair(tracks_[with].follower.kalman(), track.follower.kalman(),
                                {with, tracks_[with].area_px2}, {i, track.area_px2}));
      tracks_[i].pair = tracks_[with].pair = static_cast<std::uint32_t>(pairs_.size() - 1);
    }
  }

  /// Whether the track may become a member of a pair: a pair with separate blobs is dissolved for this.
  bool can_join_pair(const Track& track) const {
    if (track.pair == kNone) return true;
    const BlobPair& pair = pairs_[track.pair];
    return pair.is_separate() && tracks_[pair.member(0).track].blob != kNone &&
           tracks_[pair.member(1).track].blob != kNone;
  }

  bool may_merge(const Track& track, const Track& owner, const Blob& blob, double cost, double distance2) const {
    const double owner_cost = cost_of(owner, owner.blob, (blob.centroid.v - owner.aim.centre_px).squaredNorm());
    if (cost - owner_cost < kAmbiguityCost) return true;
    const bool is_merged_size = blob.area_px2 > kMergedAreaRatio * owner.area_px2;
    if (track.missed_images > 0 && !is_merged_size) return false;
    if (track.missed_images == 0 && is_merged_size)
      return true;  // within the gate, and its own blob disappeared in this image
    const double half_length = std::sqrt(blob.area_px2 / M_PI / std::max(0.1, blob.roundness));
    const double reach = half_length + 3.0 * std::sqrt(track.aim.variance_px2);
    return distance2 < reach * reach && blob.area_px2 > 0.8 * std::max(track.area_px2, owner.area_px2);
  }

  void update_pairs(std::span<const Blob> blobs) {
    for (std::size_t p = pairs_.size(); p-- > 0;) {
      BlobPair& pair = pairs_[p];
      Track* const members[2] = {&tracks_[pair.member(0).track], &tracks_[pair.member(1).track]};
      const std::uint32_t seen[2] = {members[0]->blob, members[1]->blob};
      if (seen[0] != kNone && seen[1] != kNone) {
        const Blob* const both[2] = {&blobs[seen[0]], &blobs[seen[1]]};
        pair.see_two(both, seen);
      } else if (const std::uint32_t one = seen[0] != kNone ? seen[0] : seen[1]; one != kNone) {
        pair.see_one(blobs[one], one, discs_);
      } else {
        pair.see_none();
      }
      const bool decided = pair.runner_up_margin() >= kPairDecisionCost;
      for (const std::size_t m : {std::size_t{0}, std::size_t{1}}) {
        members[m]->blob = pair.blob(m);
        members[m]->sure = decided && !pair.is_merged();
        members[m]->is_updated = true;
        members[m]->follower.restart(pair.filter(m));
        if (members[m]->blob != kNone) owner_[members[m]->blob] = pair.member(m).track;
      }
      const bool ends = pair.is_merged() ? false : decided || pair.images_separate() >= kMaxImagesApart;
      if (ends) dissolve(p);
    }
  }

  /// Ends a pair. Its members continue alone, each with its filter of the best hypothesis.
  void dissolve(std::size_t index) {
    for (const std::size_t m : {std::size_t{0}, std::size_t{1}}) {
      Track& track = tracks_[pairs_[index].member(m).track];
      track.follower.restart(pairs_[index].filter(m));
      track.pair = kNone;
    }
    if (index + 1 != pairs_.size()) {
      pairs_[index] = pairs_.back();
      for (const std::size_t m : {std::size_t{0}, std::size_t{1}}) {
        tracks_[pairs_[index].member(m).track].pair = static_cast<std::uint32_t>(index);
      }
    }
    pairs_.pop_back();
  }

  void update_tracks(std::span<const Blob> blobs) {
    bool any_ended = false;
    for (Track& track : tracks_) {
      ++track.age_images;
      if (track.blob == kNone) {
        ++track.missed_images;
        any_ended = any_ended || !track.confirmed;
        if (!track.is_updated) track.follower.coast();
        continue;
      }
      track.seen_at = at_;
      track.missed_images = 0;
      track.confirmed = track.confirmed || track.age_images >= life_.confirm_images;
      if (!track.is_updated) update_track(blobs[track.blob], variance_[track.blob], track);
    }
    if (any_ended) {
      erase_if([](const Track& track) { return !track.confirmed && track.missed_images > 0; });
    }
  }

  void update_track(const Blob& blob, double variance, Track& track) {
    const double share = blob.area_px2 / track.area_px2;
    const bool alike = share > kOccludedAreaRatio && share < kMergedAreaRatio;
    track.area_px2 += (alike ? kAreaRate : 0.1 * kAreaRate) * (blob.area_px2 - track.area_px2);
    if (share > kOccludedAreaRatio) {
      track.follower.update(blob.centroid.v, variance);
      return;
    }
    const OccludedDisc part = estimate_occluded_disc(blob, track.area_px2, track.aim.centre_px, cut_);
    track.follower.update(part.centre_px, std::max(variance, part.sigma_px * part.sigma_px));
  }

  template <class MakeFilter>
  void initiate_tracks(std::span<const Blob> blobs, MakeFilter&& make_follower) {
    for (const auto& entry : entries_) {
      if (owner_[entry.index] != kNone) continue;
      if (tracks_.size() == max_tracks_ || next_id_ == kNone) return;
      const Blob& blob = blobs[entry.index];
      Track track{make_follower(blob.centroid.v, variance_[entry.index]), {}, next_id_++};
      track.aim = track.follower.aim();
      track.blob = entry.index;
      track.confirmed = life_.confirm_images <= 1;
      track.area_px2 = std::max(1.0, blob.area_px2);
      track.seen_at = at_;
      tracks_.push_back(track);
    }
  }

  BlobTrackLife life_;
  std::size_t max_tracks_;
  BlobGrid grid_;
  geometry::Assigner assigner_;
  AssignmentAmbiguity ambiguity_;
  geometry::TwoDiscs discs_;
  geometry::CutDisc cut_;
  std::vector<Track> tracks_;
  std::vector<BlobPair> pairs_;
  std::vector<Lost> lost_;
  Timestamp at_;
  std::uint32_t next_id_ = 0;
  std::vector<BlobGrid::Entry> entries_;
  std::vector<double> variance_;      // of each blob's position, each axis, px^2
  std::vector<std::uint32_t> owner_;  // by blob: index of the assigned track
  std::vector<std::uint32_t> rows_;   // tracks of the current assignment
  std::vector<geometry::AllowedPair> candidates_;
};

}  // namespace mocap::track2d
