#include "eval/blob_pipeline.h"

#include "assemble.h"
#include "base/expects.h"
#include "track2d/following_blob_tracker.h"

namespace mocap::eval {

BlobPipeline::BlobPipeline(const settings::DaemonSettings& settings)
    : align_(settings.pipeline.align), aligner_(align_, settings.rig.size()), fusion_(assemble_fusion(settings)) {
  for (std::size_t c = 0; c < settings.rig.size(); ++c) {
    blob_trackers_.push_back(track2d::make_blob_tracker(settings.track_blobs));
  }
}

const Snapshot& BlobPipeline::step(const std::vector<BlobFrame>& frames) {
  for (const BlobFrame& frame : frames) {
    frame_ = frame;
    blob_trackers_[frame.camera.value]->track(frame_);
    aligner_.add(frame_);
  }
  const auto set = aligner_.take(frames.front().exposed_at + align_.window + align_.patience);
  MOCAP_EXPECTS(set.has_value());
  set_ = *set;
  return fusion_->step(set_);
}

}  // namespace mocap::eval
