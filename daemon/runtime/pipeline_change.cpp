// The part of Pipeline that changes a running pipeline to another configuration.
#include <algorithm>
#include <utility>

#include "base/expects.h"
#include "runtime/pipeline.h"

namespace mocap::runtime {
namespace {

void join(std::jthread& thread) {
  if (thread.joinable()) thread.join();
}

}  // namespace

// Until the row pauses, fusion, publish and record thread use the old channels. The objects that they use are kept in
// `removed_`, and a new camera may already fill its queue.
Status Pipeline::change(PipelineChange change) {
  MOCAP_EXPECTS(!change.cameras.empty() && change.cameras.size() <= kMaxCameras);
  MOCAP_EXPECTS(change.description.cameras.size() == change.cameras.size());
  MOCAP_EXPECTS(change.settings.lossless == settings_.lossless);
  settings_ = with_lossless(std::move(change.settings));
  pause_control();
  stop_calibration();
  change_cameras(change);
  if (!change.timecode_continues) {
    stop_timecode();
    start_timecode(std::move(change.timecode));
  }
  set_ptp(change.ptp);
  std::unique_ptr<BlobRecorder> ended_recorder = pause_recorder(change);
  pause_explain();
  pause_previews();
  pause_node();
  pause_row();
  close_ports(change);
  Status changed = open_control(change.open_control);
  change_row(change);
  if (changed) changed = open_publisher(change.open_publisher);
  if (changed) changed = open_trigger(change.open_trigger);
  start_side();
  start_recorder();
  start_takes();
  start_explain();
  start_previews();
  start_node();
  start_calibration();
  if (changed) start_publish();
  start_fusion();
  removed_.clear();
  for (const auto& file : std::exchange(ended_files_, {})) file->finish();
  if (const auto ended = std::exchange(ended_takes_, nullptr)) {
    ended->finish(take_worker_ ? "a reload changed [takes]" : "the configuration in force records no takes");
  }
  if (changed) start_control();
  return changed;
}

void Pipeline::pause_control() {
  control_thread_.request_stop();
  join(control_thread_);
  // An order that the main thread has not taken yet is of the cameras before, and nobody waits for its answer any more.
  while (take_order()) {
  }
}

// First the cameras whose device goes on, and of those first the ones that deliver: a thread that is opening its device
// takes long to pause. The others are closed at the same time.
void Pipeline::change_cameras(PipelineChange& change) {
  const bool records = change.blob_writer != nullptr || change.blobs_continue;
  const bool takes = change.takes != nullptr || change.takes_continue;
  const bool recording_changes =
      (std::exchange(records_blobs_, records) != records) | (std::exchange(records_takes_, takes) != takes);
  std::vector<std::size_t> refreshed;
  std::vector<std::size_t> replaced;
  for (std::size_t i = 0; i < change.cameras.size(); ++i) {
    const CameraStep step = i < cameras_.size() ? change.cameras[i].step : CameraStep::Replace;
    if (step == CameraStep::Replace) replaced.push_back(i);
    if (step == CameraStep::Refresh || (step == CameraStep::Continue && recording_changes)) refreshed.push_back(i);
  }
  for (const std::size_t i : refreshed) cameras_[i].worker->pause();
  for (const std::size_t i : refreshed) cameras_[i].thread.request_stop();
  for (const std::size_t i : replaced) {
    if (i < cameras_.size()) cameras_[i].thread.request_stop();
  }
  for (std::size_t i = change.cameras.size(); i < cameras_.size(); ++i) cameras_[i].thread.request_stop();
  std::stable_partition(refreshed.begin(), refreshed.end(), [&](std::size_t i) {
    return cameras_[i].channel->delivery.load(std::memory_order_acquire) == Delivery::Delivering;
  });
  for (const std::size_t i : refreshed) refresh_camera(i, change.cameras[i]);
  for (const std::size_t i : replaced) replace_camera(i, change);
  while (cameras_.size() > change.cameras.size()) {
    join(cameras_.back().thread);
    removed_.push_back(std::move(cameras_.back()));
    cameras_.pop_back();
  }
}

void Pipeline::refresh_camera(std::size_t camera, CameraChange& change) {
  CameraUnit& unit = cameras_[camera];
  join(unit.thread);
  if (change.step == CameraStep::Refresh) unit.worker->change(std::move(change.parts), camera_settings(camera));
  set_recording(*unit.channel);
  start_camera(camera);
}

// A camera of the same name keeps its channel, and with it its counts and its place in the sets.
void Pipeline::replace_camera(std::size_t camera, PipelineChange& change) {
  CameraUnit next;
  bool stopped = control_worker_ && !control_worker_->capturing();
  if (camera < cameras_.size()) {
    CameraUnit& before = cameras_[camera];
    join(before.thread);
    stopped = before.worker->stopped();
    before.worker->close_camera();
    const bool same = description_.cameras[camera].name == change.description.cameras[camera].name &&
                      before.channel->frames.capacity() == std::max<std::size_t>(settings_.camera_queue_frames, 1);
    if (same) next.channel = std::move(before.channel);
    removed_.push_back(std::move(before));
  } else {
    cameras_.emplace_back();
  }
  if (next.channel == nullptr) next.channel = make_channel();
  next.worker =
      std::make_unique<CameraWorker>(std::move(change.cameras[camera].parts), camera_settings(camera), *next.channel);
  next.worker->set_stopped(stopped);
  set_recording(*next.channel);
  cameras_[camera] = std::move(next);
  start_camera(camera);
}

// Call while the camera's thread does not run.
void Pipeline::set_recording(CameraChannel& channel) {
  if (records_blobs_ && channel.to_record == nullptr) {
    channel.to_record = std::make_unique<SpscQueue<BlobFrame>>(std::max<std::size_t>(settings_.record_queue_frames, 1));
  }
  channel.wake_recorder = records_blobs_ ? &wake_recorder_ : nullptr;
  if (records_takes_ && channel.to_take == nullptr) {
    channel.to_take = std::make_unique<SpscQueue<BlobFrame>>(std::max<std::size_t>(settings_.record_queue_frames, 1));
  }
  channel.wake_take = records_takes_ ? &wake_take_ : nullptr;
  if (node_worker_ && channel.to_node == nullptr) {
    channel.to_node = std::make_unique<SpscQueue<BlobFrame>>(std::max<std::size_t>(settings_.camera_queue_frames, 1));
  }
  channel.wake_node = node_worker_ ? &node_worker_->wake_descriptor() : nullptr;
}

// Ends the recorder, whose progress the publish thread still reads, or pauses it to give it the new channels.
std::unique_ptr<BlobRecorder> Pipeline::pause_recorder(PipelineChange& change) {
  if (blob_recorder_ && change.blobs_continue) blob_recorder_->pause();
  record_thread_.request_stop();
  wake_recorder_.signal();
  join(record_thread_);
  if (change.blobs_continue) {
    if (blob_recorder_) blob_recorder_->change(borrow_channels());
    return nullptr;
  }
  std::unique_ptr<BlobRecorder> ended = std::move(blob_recorder_);
  if (change.blob_writer) {
    blob_recorder_ = std::make_unique<BlobRecorder>(std::move(change.blob_writer), borrow_channels(), wake_recorder_);
  }
  return ended;
}

// Before the row, which needs not wait for an explanation that is in progress.
void Pipeline::pause_explain() {
  explain_thread_.request_stop();
  if (search_) search_->there_is_work.signal();
  join(explain_thread_);
}

void Pipeline::pause_previews() {
  preview_thread_.request_stop();
  join(preview_thread_);
}

// In the order of the data flow, so that the queues are empty afterwards.
void Pipeline::pause_row() {
  fusion_worker_->pause();
  fusion_thread_.request_stop();
  wake_fusion_.signal();
  join(fusion_thread_);
  publish_worker_->pause();
  to_publish_->there_is_work.signal();
  join(publish_thread_);
  if (!side_worker_) return;
  side_worker_->pause();
  to_side_->there_is_work.signal();
  join(side_thread_);
}

// The description in force has the fits; the next one keeps its subjects that continue.
Description Pipeline::describe_next(const PipelineChange& change) const {
  Description in_force = description_;
  for (const SubjectFit& fit : fusion_worker_->fusion().fits()) in_force = with_fit(std::move(in_force), fit);
  Description next = change.description;
  next.session_id = in_force.session_id;
  next.version = fusion_worker_->fusion().description_version() + 1;
  for (std::size_t i = 0; i < next.subjects.size() && i < change.handover.subjects.size(); ++i) {
    const SubjectId before = change.handover.subjects[i];
    if (before.value < in_force.subjects.size()) next.subjects[i] = in_force.subjects[before.value];
  }
  return next;
}

void Pipeline::change_row(PipelineChange& change) {
  description_ = describe_next(change);
  if (to_publish_->snapshots.capacity() != settings_.publish_queue_snapshots) {
    to_publish_ = std::make_unique<SnapshotChannel>(std::max<std::size_t>(settings_.publish_queue_snapshots, 1));
  }
  change_side(change);
  change_takes(change);
  set_explainer(std::move(change.explainer));
  if (preview_worker_) preview_worker_->change(borrow_channels());
  if (node_worker_) node_worker_->change(borrow_channels(), description_);
  set_calibrator(std::move(change.calibrator));
  fusion_worker_->change(
      {settings_.align, std::move(change.fusion), std::move(change.handover), settings_.fusion, fusion_links()});
  publish_worker_->change(description_, settings_.publish, publish_links());
  if (control_worker_) control_worker_->change(description_, control_links());
}

// The disk thread of a recorder that continues goes on meanwhile: it may wait for the disk.
void Pipeline::change_takes(PipelineChange& change) {
  stop_take_intake();
  if (change.takes_continue) {
    if (!take_worker_) return;
    if (to_takes_->snapshots.capacity() != side_queue()) {
      to_takes_ = std::make_unique<SnapshotChannel>(side_queue());
    }
    return take_worker_->change(description_, std::move(change.take_files), borrow_channels(), *to_takes_);
  }
  stop_take_disk();
  ended_takes_ = std::move(take_worker_);
  set_takes(std::move(change.takes));
}

void Pipeline::change_side(PipelineChange& change) {
  const bool writes = side_worker_ || !change.writers.empty();
  if (writes && (!to_side_ || to_side_->snapshots.capacity() != side_queue())) {
    to_side_ = std::make_unique<SnapshotChannel>(side_queue());
  }
  if (!writes) return;
  if (!side_worker_) {
    side_worker_ = std::make_unique<SideWorker>(std::vector<std::unique_ptr<Writer>>{}, settings_.lossless, *to_side_,
                                                side_counters_);
  }
  ended_files_ =
      side_worker_->change({std::move(change.writers), change.snapshots_continue, &description_, to_side_.get()});
}

// All that change, before one of them is opened: they may exchange their ports.
void Pipeline::close_ports(const PipelineChange& change) {
  if (change.open_control && control_worker_) control_worker_->close_server();
  if (change.open_publisher) publish_worker_->close_publisher();
  if (change.open_trigger) {
    stop_trigger();
    set_trigger(nullptr);
  }
}

Status Pipeline::open_publisher(const OpenPart<Publisher>& open) {
  if (!open) return {};
  Result<std::unique_ptr<Publisher>> publisher = open();
  if (!publisher) return publisher.error();
  publish_worker_->set_publisher(std::move(*publisher));
  return {};
}

Status Pipeline::open_trigger(const OpenPart<TriggerParts>& open) {
  if (!open) return {};
  Result<std::unique_ptr<TriggerParts>> parts = open();
  if (!parts) return parts.error();
  set_trigger(std::move(*parts));
  start_trigger();
  return {};
}

Status Pipeline::open_control(const OpenPart<ControlServer>& open) {
  if (!open) return {};
  Result<std::unique_ptr<ControlServer>> server = open();
  if (!server) return server.error();
  if (*server == nullptr) {
    control_worker_.reset();
    control_.reset();
  } else if (control_worker_) {
    control_worker_->set_server(std::move(*server));
  } else {
    control_ = std::make_unique<ControlChannel>();
    control_->wake_fusion = &wake_fusion_;
    control_worker_ =
        std::make_unique<ControlWorker>(std::move(*server), description_, settings_.lossless, control_links());
  }
  return {};
}

}  // namespace mocap::runtime
