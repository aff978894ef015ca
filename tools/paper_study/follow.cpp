#include "paper_study/follow.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "base/expects.h"
#include "track2d/blob_track_inspection.h"

namespace mocap::paper_study {
namespace {

using track2d::BlobTrackBelief;

constexpr double kOffFromMarker_px = 15.0;

class Follower {
 public:
  Follower(BlobTracker& tracker, const Clip& clip)
      : tracker_(tracker), inspection_(dynamic_cast<const track2d::BlobTrackInspection*>(&tracker)), clip_(clip) {
    MOCAP_EXPECTS(inspection_ != nullptr);
  }

  Followed follow(std::span<const Seen> sightings) {
    show(sightings.front(), true);
    if (frame_->blobs.empty()) return {{}, {}, true};
    const std::optional<BlobTrackBelief> first = belief_of({}, sightings.front().at);
    MOCAP_EXPECTS(first.has_value());
    label_ = first->track;
    last_.predicted_px = last_.label_px = clip_.ways_px[0][0];

    Followed followed;
    for (std::size_t k = 1; k < sightings.size(); ++k) {
      followed.frames.push_back(step(sightings[k]));
      followed.errors_px.push_back((last_.predicted_px - clip_.ways_px[0][k]).norm());
      if (loss_rule_of(clip_.situation) == LossRule::AnyMiss && !holds_marker(k)) followed.lost = true;
    }
    if (!last_.named || !holds_marker(sightings.size() - 1)) followed.lost = true;
    return followed;
  }

 private:
  void show(const Seen& seen, bool only_the_labelled) {
    frame_->exposed_at = seen.at;
    frame_->blobs.clear();
    for (const Blob& blob : seen.blobs) {
      const bool near = (blob.centroid.v - clip_.ways_px[0][0]).norm() < kOffFromMarker_px;
      if (near || !only_the_labelled) frame_->blobs.push_back(blob);
    }
    tracker_.track(*frame_);
  }

  /// The belief of the label's track. Before the label has a track, the belief of the only track.
  std::optional<BlobTrackBelief> belief_of(BlobTrackId track, Timestamp at) {
    beliefs_.clear();
    inspection_->predict_tracks(at, beliefs_);
    const auto wanted = [&](const BlobTrackBelief& belief) {
      return !track.names_something() || belief.track == track;
    };
    const auto found = std::ranges::find_if(beliefs_, wanted);
    return found == beliefs_.end() ? std::nullopt : std::optional(*found);
  }

  FollowedFrame step(const Seen& seen) {
    const std::optional<BlobTrackBelief> ahead = belief_of(label_, seen.at);
    if (ahead) last_.predicted_px = ahead->point.v;
    last_.gate_radius_px = ahead ? ahead->gate_radius_px : 0.0;

    show(seen, false);

    const std::optional<BlobTrackBelief> now = belief_of(label_, seen.at);
    last_.held = now && now->blob != BlobTrackBelief::kUnseen;
    last_.named = last_.held && frame_->blobs[now->blob].track == label_;
    if (last_.held) {
      last_.label_px = frame_->blobs[now->blob].centroid.v;
    } else if (now) {
      last_.label_px = now->point.v;
    }
    return last_;
  }

  bool holds_marker(std::size_t frame) const {
    return last_.held && (last_.label_px - clip_.ways_px[0][frame]).norm() <= kOffFromMarker_px;
  }

  BlobTracker& tracker_;
  const track2d::BlobTrackInspection* inspection_;
  const Clip& clip_;
  std::unique_ptr<BlobFrame> frame_ = std::make_unique<BlobFrame>();  // on the heap because a BlobFrame is large
  std::vector<BlobTrackBelief> beliefs_;
  BlobTrackId label_;
  FollowedFrame last_;
};

}  // namespace

Followed follow(BlobTracker& tracker, const Clip& clip, std::span<const Seen> sightings) {
  return Follower(tracker, clip).follow(sightings);
}

}  // namespace mocap::paper_study
