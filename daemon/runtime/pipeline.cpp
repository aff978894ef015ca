#include "runtime/pipeline.h"

#include <algorithm>
#include <string>
#include <utility>

namespace mocap::runtime {
namespace {

// Snapshots that wait for the intake of takes: 0.25 s at 120 Hz; 0.5 MB each.
constexpr std::size_t kTakeSnapshots = 32;

std::size_t at_least_one(std::size_t count) { return std::max<std::size_t>(count, 1); }

std::vector<std::string> subject_names(const Description& description) {
  std::vector<std::string> names;
  for (const Subject& subject : description.subjects) names.push_back(subject.name);
  return names;
}

}  // namespace

Pipeline::Pipeline(PipelineSettings settings, PipelineParts parts)
    : settings_(with_lossless(std::move(settings))),
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
  if (!parts.writers.empty()) {
    to_side_ = std::make_unique<SnapshotChannel>(at_least_one(settings_.side_queue_snapshots));
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
          preview_worker_ ? &preview_channel_ : nullptr};
}

ControlWorker::Links Pipeline::control_links() {
  return {control_.get(), borrow_channels(), records_takes_ ? &take_channel_ : nullptr, calibration_.get()};
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

void Pipeline::start_camera(std::size_t camera) {
  CameraUnit& unit = cameras_[camera];
  unit.worker->resume();
  unit.thread = std::jthread([worker = unit.worker.get(), camera](const std::stop_token& token) {
    name_this_thread(("mocap-cam" + std::to_string(camera)).c_str());
    worker->run(token);
  });
}

void Pipeline::start_side() {
  if (!side_worker_) return;
  side_worker_->resume();
  side_thread_ = std::jthread([this] {
    name_this_thread("mocap-side");
    side_worker_->run();
  });
}

void Pipeline::start_recorder() {
  if (!blob_recorder_) return;
  blob_recorder_->resume();
  record_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-record");
    blob_recorder_->run(token);
  });
}

void Pipeline::start_explain() {
  if (!explain_worker_) return;
  explain_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-explain");
    explain_worker_->run(token);
  });
}

void Pipeline::start_previews() {
  if (!preview_worker_) return;
  preview_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-preview");
    preview_worker_->run(token);
  });
}

void Pipeline::start_node() {
  if (!node_worker_) return;
  node_worker_->resume();
  node_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-node");
    node_worker_->run(token);
  });
}

void Pipeline::pause_node() {
  if (!node_worker_) return;
  node_worker_->pause();
  node_thread_.request_stop();
  node_worker_->wake();
  if (node_thread_.joinable()) node_thread_.join();
}

// Call while the threads of fusion, control and calibration do not run.
void Pipeline::set_calibrator(std::unique_ptr<RigCalibrator> calibrator) {
  calibration_worker_.reset();
  calibration_.reset();
  if (!calibrator) return;
  calibration_ = std::make_unique<CalibrationChannel>();
  calibration_worker_ = std::make_unique<CalibrationWorker>(std::move(calibrator), borrow_channels(), *calibration_);
}

void Pipeline::start_calibration() {
  if (!calibration_worker_) return;
  calibration_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-calibrat");
    calibration_worker_->run(token);
  });
}

// Waits for a collection, but not for a step of a solution, which may last longer than the watchdog waits.
void Pipeline::stop_calibration() {
  std::erase_if(ended_calibrations_, [](const EndedCalibration& ended) { return ended.worker->has_ended(); });
  if (!calibration_worker_) return;
  calibration_thread_.request_stop();
  calibration_->ordered.signal();
  if (calibration_worker_->is_solving()) {
    ended_calibrations_.push_back(
        {std::move(calibration_), std::move(calibration_worker_), std::move(calibration_thread_)});
  } else if (calibration_thread_.joinable()) {
    calibration_thread_.join();
  }
}

// Call while the threads of fusion, publish, control and takes do not run.
void Pipeline::set_takes(std::unique_ptr<TakeRecorder> recorder) {
  to_takes_.reset();
  if (!recorder) return;
  to_takes_ = std::make_unique<SnapshotChannel>(kTakeSnapshots);
  take_worker_ = std::make_unique<TakeWorker>(std::move(recorder), borrow_channels(), *to_takes_, take_channel_,
                                              timecode_channel_, wake_take_);
}

void Pipeline::start_takes() {
  if (!take_worker_) return;
  take_intake_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-takes");
    take_worker_->run_intake(token);
  });
  if (take_disk_thread_.joinable()) return;  // went on through a change
  take_disk_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-disk");
    take_worker_->run_disk(token);
  });
}

// Stop the threads of cameras and fusion before, so that the queues are empty afterwards.
void Pipeline::stop_take_intake() {
  take_intake_thread_.request_stop();
  wake_take_.signal();
  if (take_intake_thread_.joinable()) take_intake_thread_.join();
}

void Pipeline::stop_take_disk() {
  take_disk_thread_.request_stop();
  if (take_disk_thread_.joinable()) take_disk_thread_.join();
}

// Call while the trigger thread does not run.
void Pipeline::set_trigger(std::unique_ptr<TriggerParts> parts) {
  trigger_worker_.reset();
  take_channel_.news_wanted.store(parts != nullptr, std::memory_order_release);
  while (take_channel_.news.front() != nullptr) take_channel_.news.pop();
  if (parts) trigger_worker_ = std::make_unique<TriggerWorker>(std::move(*parts), take_channel_);
}

void Pipeline::start_trigger() {
  if (!trigger_worker_) return;
  trigger_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-trigger");
    trigger_worker_->run(token);
  });
}

void Pipeline::stop_trigger() {
  trigger_thread_.request_stop();
  take_channel_.news_came.signal();
  if (trigger_thread_.joinable()) trigger_thread_.join();
}

// Null: no source.
void Pipeline::start_timecode(std::unique_ptr<TimecodeSource> source) {
  if (!source) return;
  timecode_worker_ = std::make_unique<TimecodeWorker>(std::move(source), timecode_channel_);
  timecode_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-timecode");
    timecode_worker_->run(token);
  });
}

void Pipeline::stop_timecode() {
  timecode_thread_.request_stop();
  if (timecode_thread_.joinable()) timecode_thread_.join();
  timecode_worker_.reset();
  static_cast<void>(timecode_channel_.to_takes.try_push({}));  // a take that waits for a timecode waits for ever
}

void Pipeline::start_publish() {
  publish_worker_->resume();
  publish_thread_ = std::jthread([this] {
    name_this_thread("mocap-publish");
    publish_worker_->run();
    if (!publish_worker_->pausing()) publish_ended_.store(true, std::memory_order_release);
  });
}

void Pipeline::start_fusion() {
  fusion_worker_->resume();
  fusion_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-fusion");
    fusion_worker_->run(token);
  });
}

void Pipeline::start_control() {
  if (!control_worker_) return;
  control_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-control");
    control_worker_->run(token);
  });
}

std::optional<MainOrder> Pipeline::take_order() {
  MainOrder order;
  if (control_ == nullptr || !control_->to_main.try_pop(order)) return std::nullopt;
  return order;
}

void Pipeline::answer(MainDone answer) {
  if (control_ != nullptr) static_cast<void>(control_->from_main.try_push(answer));
}

void Pipeline::stop() {
  control_thread_.request_stop();
  if (control_thread_.joinable()) control_thread_.join();
  stop_calibration();
  ended_calibrations_.clear();
  // The threads stop in the order of the data flow: a thread ends when no thread before it can produce data.
  for (CameraUnit& camera : cameras_) camera.thread.request_stop();
  for (CameraUnit& camera : cameras_) {
    if (camera.thread.joinable()) camera.thread.join();
  }
  record_thread_.request_stop();
  wake_recorder_.signal();
  if (record_thread_.joinable()) record_thread_.join();
  fusion_thread_.request_stop();
  wake_fusion_.signal();
  if (fusion_thread_.joinable()) fusion_thread_.join();
  pause_node();
  stop_take_intake();
  stop_take_disk();
  if (take_worker_) {
    take_worker_->finish();
    take_worker_->tell_changes();
  }
  stop_trigger();
  // After the end of the fusion thread, the publish and side threads process the waiting snapshots and return.
  if (publish_thread_.joinable()) publish_thread_.join();
  if (side_thread_.joinable()) side_thread_.join();
  stop_timecode();
  explain_thread_.request_stop();
  if (search_) search_->there_is_work.signal();
  if (explain_thread_.joinable()) explain_thread_.join();
  pause_previews();
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
