#include "runtime/pipeline.h"

#include <algorithm>
#include <string>

namespace mocap::runtime {
namespace {

std::size_t at_least_one(std::size_t count) { return std::max<std::size_t>(count, 1); }

}  // namespace

Pipeline::Pipeline(PipelineSettings settings, PipelineParts parts)
    : to_publish_(at_least_one(settings.publish_queue_snapshots)),
      to_side_(parts.writers.empty() ? 1 : at_least_one(settings.side_queue_snapshots)) {
  MOCAP_EXPECTS(!parts.cameras.empty() && parts.cameras.size() <= kMaxCameras);
  MOCAP_EXPECTS(parts.description.cameras.size() == parts.cameras.size());
  settings.camera.lossless = settings.fusion.lossless = settings.publish.lossless = settings.lossless;
  std::vector<const StreamCounters*> streams;
  for (std::size_t i = 0; i < parts.cameras.size(); ++i) {
    streams.push_back(parts.cameras[i].stream.get());
    channels_.push_back(std::make_unique<CameraChannel>(at_least_one(settings.camera_queue_frames), wake_fusion_));
    if (parts.blob_writer) {
      channels_.back()->to_record = std::make_unique<SpscQueue<BlobFrame>>(at_least_one(settings.record_queue_frames));
      channels_.back()->wake_recorder = &wake_recorder_;
    }
    CameraWorkerSettings camera = settings.camera;
    if (i < settings.camera_threads.size()) camera.thread = settings.camera_threads[i];
    camera_workers_.push_back(std::make_unique<CameraWorker>(std::move(parts.cameras[i]), camera, *channels_[i]));
  }
  const bool writes = !parts.writers.empty();
  if (parts.control != nullptr) {
    control_ = std::make_unique<ControlChannel>();
    control_->wake_fusion = &wake_fusion_;
    control_worker_ = std::make_unique<ControlWorker>(std::move(parts.control), parts.description, settings.lossless,
                                                      ControlWorker::Links{control_.get(), borrow_channels()});
  }
  fusion_worker_ = std::make_unique<FusionWorker>(
      settings.align, std::move(parts.fusion), settings.fusion,
      FusionWorker::Links{borrow_channels(), &to_publish_, writes ? &to_side_ : nullptr, &wake_fusion_, control_.get()},
      fusion_counters_);
  publish_worker_ = std::make_unique<PublishWorker>(
      std::move(parts.publisher), std::move(parts.description), settings.publish,
      PublishWorker::Links{&to_publish_, borrow_channels(), streams, &fusion_counters_, control_.get()},
      publish_counters_);
  if (writes) {
    side_worker_ = std::make_unique<SideWorker>(std::move(parts.writers), settings.lossless, to_side_, side_counters_);
  }
  if (parts.blob_writer) {
    blob_recorder_ = std::make_unique<BlobRecorder>(std::move(parts.blob_writer), borrow_channels(), wake_recorder_);
  }
  start_threads();
}

Pipeline::~Pipeline() { stop(); }

std::vector<CameraChannel*> Pipeline::borrow_channels() {
  std::vector<CameraChannel*> borrowed;
  for (const auto& channel : channels_) borrowed.push_back(channel.get());
  return borrowed;
}

void Pipeline::start_threads() {
  // Consumers first: nobody waits for room that no thread will ever make.
  if (side_worker_) {
    side_thread_ = std::jthread([this] {
      name_this_thread("mocap-side");
      side_worker_->run();
    });
  }
  if (blob_recorder_) {
    record_thread_ = std::jthread([this](const std::stop_token& token) {
      name_this_thread("mocap-record");
      blob_recorder_->run(token);
    });
  }
  publish_thread_ = std::jthread([this] {
    name_this_thread("mocap-publish");
    publish_worker_->run();
    publish_ended_.store(true, std::memory_order_release);
  });
  fusion_thread_ = std::jthread([this](const std::stop_token& token) {
    name_this_thread("mocap-fusion");
    fusion_worker_->run(token);
  });
  for (std::size_t i = 0; i < camera_workers_.size(); ++i) {
    camera_threads_.emplace_back([this, i](const std::stop_token& token) {
      name_this_thread(("mocap-cam" + std::to_string(i)).c_str());
      camera_workers_[i]->run(token);
    });
  }
  if (control_worker_) {
    control_thread_ = std::jthread([this](const std::stop_token& token) {
      name_this_thread("mocap-control");
      control_worker_->run(token);
    });
  }
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
  // Along the way of the data: each thread ends when nothing more can come to it.
  for (std::jthread& thread : camera_threads_) thread.request_stop();
  for (std::jthread& thread : camera_threads_) {
    if (thread.joinable()) thread.join();
  }
  record_thread_.request_stop();
  wake_recorder_.signal();
  if (record_thread_.joinable()) record_thread_.join();
  fusion_thread_.request_stop();
  wake_fusion_.signal();
  if (fusion_thread_.joinable()) fusion_thread_.join();
  // The fusion's end lets publish and side work off what waits, and end by themselves.
  if (publish_thread_.joinable()) publish_thread_.join();
  if (side_thread_.joinable()) side_thread_.join();
}

Pipeline::Progress Pipeline::progress() const {
  Progress now;
  for (const auto& channel : channels_) now.frames += channel->counters.frames.read();
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
  // A few images may be on their way between two looks; many without a set are a fusion that stands still.
  const std::uint64_t on_their_way = 2 * camera_count();
  const bool images_become_sets =
      last_progress_.frames < before.frames + on_their_way || last_progress_.sets > before.sets;
  return finished() || (loops && images_become_sets);
}

}  // namespace mocap::runtime
