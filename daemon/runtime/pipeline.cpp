#include "runtime/pipeline.h"

#include <algorithm>
#include <string>
#include <utility>

namespace mocap::runtime {
namespace {

std::size_t at_least_one(std::size_t count) { return std::max<std::size_t>(count, 1); }

std::vector<std::string> subject_names(const Description& description) {
  std::vector<std::string> names;
  for (const Subject& subject : description.subjects) names.push_back(subject.name);
  return names;
}

}  // namespace

Pipeline::Pipeline(PipelineSettings settings, PipelineParts parts)
    : settings_(with_lossless(std::move(settings))),
      audit_(parts.audit),
      description_(std::move(parts.description)),
      records_blobs_(parts.blob_writer != nullptr),
      records_takes_(parts.takes != nullptr),
      to_publish_(std::make_unique<SnapshotChannel>(at_least_one(settings_.publish_queue_snapshots))) {
  MOCAP_EXPECTS(!parts.cameras.empty() && parts.cameras.size() <= kMaxCameras);
  MOCAP_EXPECTS(description_.cameras.size() == parts.cameras.size());
  if (parts.node) node_worker_ = std::make_unique<NodeWorker>(std::move(parts.node), settings_.lossless);
  for (CameraParts& camera : parts.cameras) {
    CameraUnit& unit = cameras_.emplace_back();
    unit.channel = make_channel();
    unit.worker =
        std::make_unique<CameraWorker>(std::move(camera), camera_settings(cameras_.size() - 1), *unit.channel);
    set_recording(*unit.channel);
  }
  if (node_worker_) node_worker_->change(borrow_channels(), description_);
  set_takes(std::move(parts.takes));
  set_trigger(std::move(parts.trigger));
  start_timecode(std::move(parts.timecode));
  set_ptp(parts.ptp);
  if (!parts.writers.empty()) {
    to_side_ = std::make_unique<SnapshotChannel>(side_queue());
    side_worker_ =
        std::make_unique<SideWorker>(std::move(parts.writers), settings_.lossless, *to_side_, side_counters_);
  }
  set_calibrator(std::move(parts.calibrator));
  if (parts.control != nullptr) {
    control_ = std::make_unique<ControlChannel>();
    control_->wake_fusion = &wake_fusion_;
    control_worker_ =
        std::make_unique<ControlWorker>(std::move(parts.control), description_, settings_.lossless, control_links());
  }
  set_explainer(std::move(parts.explainer));
  if (parts.preview_encoder) {
    preview_worker_ =
        std::make_unique<PreviewWorker>(std::move(parts.preview_encoder), borrow_channels(), preview_channel_);
  }
  fusion_worker_ = std::make_unique<FusionWorker>(settings_.align, std::move(parts.fusion), settings_.fusion,
                                                  fusion_links(), fusion_counters_);
  if (parts.blob_writer) {
    blob_recorder_ = std::make_unique<BlobRecorder>(std::move(parts.blob_writer), borrow_channels(), wake_recorder_);
  }
  publish_worker_ = std::make_unique<PublishWorker>(std::move(parts.publisher), description_, settings_.publish,
                                                    publish_links(), publish_counters_);
  // Consumers start first, so that no producer waits for a consumer that does not run.
  start_side();
  start_recorder();
  start_takes();
  start_explain();
  start_previews();
  start_node();
  start_publish();
  start_fusion();
  for (std::size_t i = 0; i < cameras_.size(); ++i) start_camera(i);
  start_calibration();
  start_control();
  start_trigger();
}

Pipeline::~Pipeline() { stop(); }

PipelineSettings Pipeline::with_lossless(PipelineSettings settings) {
  settings.camera.lossless = settings.fusion.lossless = settings.publish.lossless = settings.lossless;
  return settings;
}

CameraWorkerSettings Pipeline::camera_settings(std::size_t camera) const {
  CameraWorkerSettings settings = settings_.camera;
  if (camera < settings_.camera_threads.size()) settings.thread = settings_.camera_threads[camera];
  return settings;
}

std::unique_ptr<CameraChannel> Pipeline::make_channel() {
  auto channel = std::make_unique<CameraChannel>(at_least_one(settings_.camera_queue_frames), wake_fusion_);
  channel->wake_preview = &preview_channel_.there_is_work;
  return channel;
}

std::vector<CameraChannel*> Pipeline::borrow_channels() const {
  std::vector<CameraChannel*> borrowed;
  for (const CameraUnit& camera : cameras_) borrowed.push_back(camera.channel.get());
  return borrowed;
}

std::vector<const StreamCounters*> Pipeline::borrow_streams() const {
  std::vector<const StreamCounters*> borrowed;
  for (const CameraUnit& camera : cameras_) borrowed.push_back(&camera.worker->stream_counters());
  return borrowed;
}

// Call while the threads of fusion, publish and explain do not run. Reports with indices of the subjects before are
// dropped with their channel.
void Pipeline::set_explainer(std::unique_ptr<SearchExplainer> explainer) {
  explain_worker_.reset();
  search_.reset();
  if (!explainer) return;
  search_ = std::make_unique<SearchChannel>();
  explain_worker_ =
      std::make_unique<ExplainWorker>(std::move(explainer), subject_names(description_), borrow_channels(), *search_);
}

FusionWorker::Links Pipeline::fusion_links() {
  return {borrow_channels(),
          to_publish_.get(),
          to_side_.get(),
          to_takes_.get(),
          beliefs_.get(),
          &wake_fusion_,
          control_.get(),
          search_.get(),
          timecode_worker_ ? &timecode_channel_ : nullptr,
          calibration_ ? &calibration_->markers : nullptr};
}

PublishWorker::Links Pipeline::publish_links() {
  return {to_publish_.get(),
          borrow_channels(),
          borrow_streams(),
          &fusion_counters_,
          control_.get(),
          recordings(),
          search_.get(),
          records_takes_ ? &take_channel_ : nullptr,
          timecode_worker_ ? &timecode_channel_ : nullptr,
          preview_worker_ ? &preview_channel_ : nullptr,
          audit_};
}

ControlWorker::Links Pipeline::control_links() {
  return {control_.get(), borrow_channels(), records_takes_ ? &take_channel_ : nullptr, calibration_.get(), audit_};
}

std::vector<const RecordingProgress*> Pipeline::recordings() const {
  std::vector<const RecordingProgress*> all;
  if (side_worker_) all = side_worker_->recordings();
  if (blob_recorder_) all.push_back(&blob_recorder_->recording());
  return all;
}

bool Pipeline::records_snapshots() const {
  if (!side_worker_) return false;
  const std::vector<const RecordingProgress*> all = side_worker_->recordings();
  return !all.empty() && std::ranges::all_of(all, [](const RecordingProgress* recording) {
    return recording->state() == RecordingState::Recording;
  });
}

bool Pipeline::records_blobs() const {
  return blob_recorder_ && blob_recorder_->recording().state() == RecordingState::Recording;
}

std::optional<MainOrder> Pipeline::take_order() {
  MainOrder order;
  if (control_ == nullptr || !control_->to_main.try_pop(order)) return std::nullopt;
  return order;
}

void Pipeline::answer(MainDone answer) {
  if (control_ != nullptr) static_cast<void>(control_->from_main.try_push(answer));
}

Pipeline::Progress Pipeline::progress() const {
  Progress now;
  for (const CameraUnit& camera : cameras_) now.frames += camera.channel->counters.frames.read();
  now.fusion_beats = fusion_counters_.beats.read();
  now.sets = fusion_counters_.sets.read();
  now.publish_beats = publish_counters_.beats.read();
  now.side_beats = side_counters_.beats.read();
  return now;
}

bool Pipeline::progressed() {
  const Progress before = last_progress_;
  last_progress_ = progress();
  const bool loops = last_progress_.fusion_beats > before.fusion_beats &&
                     last_progress_.publish_beats > before.publish_beats &&
                     (side_worker_ == nullptr || last_progress_.side_beats > before.side_beats);
  // Up to two images of each camera may still be in the queues. More images without a new set mean that fusion hangs.
  const std::uint64_t in_queues = 2 * camera_count();
  const bool images_become_sets =
      last_progress_.frames < before.frames + in_queues || last_progress_.sets > before.sets;
  return finished() || (loops && images_become_sets);
}

}  // namespace mocap::runtime
