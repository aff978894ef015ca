#include "eval/marker_pipeline.h"

#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "track2d/following_blob_tracker.h"
#include "track3d/kalman_marker_tracker.h"

namespace mocap::eval {
namespace {

constexpr synchronise::AlignSettings kAlign{};

}  // namespace

MarkerPipeline::MarkerPipeline(const Rig& rig)
    : aligner_(kAlign, rig.size()),
      matcher_(associate::make_matcher({}, rig)),
      triangulator_(associate::make_triangulator({}, rig)),
      tracker_(track3d::make_marker_tracker({})),
      identities_(rig.size()) {
  for (std::size_t c = 0; c < rig.size(); ++c) blob_trackers_.push_back(track2d::make_blob_tracker({}));
}

bool MarkerPipeline::step(const simworld::SeenInstant& seen) {
  for (const auto& frame : seen.frames) {
    if (!frame) continue;
    frame_ = *frame;
    blob_trackers_[frame_.camera.value]->track(frame_);
    aligner_.add(frame_);
  }
  const auto set = aligner_.take(seen.exposed_at + kAlign.window + kAlign.patience);
  if (!set) return false;
  set_ = *set;
  predicted_ = &identities_.predict(*set, tracker_->predict(set->exposed_at), {});
  matches_ = &matcher_->match(*set, *predicted_);
  markers_ = &triangulator_->triangulate(*set, *matches_);
  tracked_ = &tracker_->step(*markers_, *predicted_, matches_->bearing_only);
  identities_.update(*set, *matches_, {});
  return true;
}

}  // namespace mocap::eval
