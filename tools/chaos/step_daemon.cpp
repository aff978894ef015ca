#include "chaos/step_daemon.h"

#include <malloc.h>

#include <utility>

#include "assemble.h"
#include "track2d/following_blob_tracker.h"

namespace mocap::chaos {
namespace {

constexpr Duration kAssessTiming = std::chrono::seconds(1);  // as FusionWorker

std::int64_t heap_bytes() {
  const struct mallinfo2 heap = ::mallinfo2();
  return static_cast<std::int64_t>(heap.uordblks) + static_cast<std::int64_t>(heap.hblkhd);
}

}  // namespace

StepDaemon::StepDaemon(settings::DaemonSettings settings, const std::string& clock, Outputs outputs)
    : settings_(std::make_unique<settings::DaemonSettings>(std::move(settings))),
      outputs_(std::move(outputs)),
      cameras_(settings_->rig.size()),
      aligner_(settings_->pipeline.align, settings_->rig.size()),
      fusion_(assemble_fusion(*settings_)) {
  cameras::AravisSettings aravis;
  aravis.clock = clock;
  for (std::uint32_t c = 0; c < cameras_.size(); ++c) {
    cameras_[c].clock = std::make_unique<cameras::ExposureClock>(settings_->rig[c].name, aravis);
    cameras_[c].tracker = track2d::make_blob_tracker(settings_->track_blobs);
    aligner_.finish(CameraId{c});
  }
}

void StepDaemon::receive(const Arrival& arrival, Timestamp now) {
  CameraSide& camera = cameras_[arrival.camera.value];
  camera.heard_at = now;
  frame_.camera = arrival.camera;
  frame_.number = arrival.number;
  frame_.exposed_at = camera.clock->middle_of({.stamp = arrival.stamp,
                                               .exposure = kExposure,
                                               .stamp_tells_begin = true,
                                               .first_byte = arrival.first_byte,
                                               .received = arrival.received,
                                               .utc_minus_host = kUtcMinusHost},
                                              true);
  frame_.received_at = arrival.received;
  frame_.detected_at = now;
  frame_.blobs.clear();
  for (const Blob& blob : arrival.blobs) static_cast<void>(frame_.blobs.try_push_back(blob));
  camera.tracker->track(frame_);
  outputs_.frame(frame_);
  ++counts_.received;
  if (camera.queue.size() < settings_->pipeline.camera_queue_frames) {
    camera.queue.push_back(frame_);
  } else {
    ++counts_.dropped;
  }
}

void StepDaemon::lose(CameraId id) {
  CameraSide& camera = cameras_[id.value];
  if (camera.heard_at) end(camera, id);
}

void StepDaemon::end(CameraSide& camera, CameraId id) {
  camera.heard_at.reset();
  camera.clock->reset();
  // The camera has ended for the aligner only when the frames before its end have left the queue.
  while (!camera.queue.empty() && aligner_.has_room(id)) {
    aligner_.add(camera.queue.front());
    camera.queue.pop_front();
  }
  counts_.dropped += camera.queue.size();
  camera.queue.clear();
  if (std::exchange(camera.expected, false)) aligner_.finish(id);
}

void StepDaemon::work(Timestamp now) {
  for (std::uint32_t c = 0; c < cameras_.size(); ++c) {
    CameraSide& camera = cameras_[c];
    if (camera.heard_at && now - *camera.heard_at > settings_->pipeline.camera.silent_after) end(camera, CameraId{c});
  }
  for (bool any = true; any;) {
    const bool gathered = gather();
    any = fuse_ready_sets(now) || gathered;
  }
  if (now - assessed_at_ < kAssessTiming) return;
  assessed_at_ = now;
  aligner_.assess_timing();
}

bool StepDaemon::gather() {
  bool any = false;
  for (std::uint32_t c = 0; c < cameras_.size(); ++c) {
    CameraSide& camera = cameras_[c];
    if (camera.heard_at && !std::exchange(camera.expected, true)) aligner_.rejoin(CameraId{c});
    while (!camera.queue.empty() && aligner_.has_room(CameraId{c})) {
      aligner_.add(camera.queue.front());
      camera.queue.pop_front();
      any = true;
    }
  }
  return any;
}

bool StepDaemon::fuse_ready_sets(Timestamp now) {
  bool any = false;
  while (const std::optional<FrameSet> set = aligner_.take(now)) {
    any = true;
    counts_.used += set->views.size();
    if (aligner_.is_superseded(*set, now)) {
      ++counts_.passed_over;
    } else {
      fuse(*set, now);
    }
  }
  return any;
}

void StepDaemon::fuse(const FrameSet& set, Timestamp now) {
  const std::int64_t before_bytes = heap_bytes();
  Snapshot& snapshot = fusion_->step(set);
  if (++steps_ > static_cast<std::uint64_t>(settings_->nominal_rate_hz)) {
    step_growth_bytes_ += heap_bytes() - before_bytes;
  }
  snapshot.instants.fused_at = now;
  outputs_.set(snapshot, fusion_->fit(), now);
}

void StepDaemon::reload(settings::DaemonSettings settings, const Handover& handover) {
  auto next_settings = std::make_unique<settings::DaemonSettings>(std::move(settings));
  auto next = assemble_fusion(*next_settings);
  next->adopt(*fusion_, handover);
  fusion_ = std::move(next);
  if (!(next_settings->pipeline.align == settings_->pipeline.align)) {
    counts_.dropped += in_aligner();
    synchronise::FrameAligner aligner(next_settings->pipeline.align, cameras_.size());
    aligner.continue_after(aligner_);
    aligner_ = std::move(aligner);
    for (std::uint32_t c = 0; c < cameras_.size(); ++c) {
      aligner_.finish(CameraId{c});
      cameras_[c].expected = false;
    }
  }
  settings_ = std::move(next_settings);
}

void StepDaemon::finish(Timestamp now) {
  for (std::uint32_t c = 0; c < cameras_.size(); ++c) end(cameras_[c], CameraId{c});
  work(now);
}

// The images that wait for their set. All others are counted elsewhere.
std::uint64_t StepDaemon::in_aligner() const {
  const FrameCounts now = counts();
  return now.received - now.used - now.dropped - now.waiting;
}

FrameCounts StepDaemon::counts() const {
  FrameCounts counts = counts_;
  const synchronise::AlignCounts& aligned = aligner_.counts();
  counts.dropped += aligned.late + aligned.repeated + aligned.overflow + aligned.cleared;
  for (const CameraSide& camera : cameras_) counts.waiting += camera.queue.size();
  return counts;
}

}  // namespace mocap::chaos
