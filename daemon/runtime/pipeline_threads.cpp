// The part of Pipeline that starts and stops its threads.
#include <string>
#include <utility>

#include "runtime/pipeline.h"
#include "runtime/ptp_worker.h"

namespace mocap::runtime {
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
  beliefs_.reset();
  if (!recorder) return;
  to_takes_ = std::make_unique<SnapshotChannel>(side_queue());
  beliefs_ = std::make_unique<SpscQueue<Belief>>(1);
  const TakeWorker::Links links{*beliefs_,  take_channel_, timecode_channel_, fusion_counters_.dropped_take_full,
                                wake_take_, audit_};
  take_worker_ = std::make_unique<TakeWorker>(std::move(recorder), borrow_channels(), *to_takes_, links);
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

// Null: no thread.
void Pipeline::set_ptp(PtpClock* clock) {
  if ((clock != nullptr) == ptp_thread_.joinable()) return;
  if (clock == nullptr) {
    ptp_thread_ = {};
    return;
  }
  ptp_thread_ = std::jthread([clock](const std::stop_token& token) {
    name_this_thread("mocap-ptp");
    PtpWorker(*clock).run(token);
  });
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
  set_ptp(nullptr);
  explain_thread_.request_stop();
  if (search_) search_->there_is_work.signal();
  if (explain_thread_.joinable()) explain_thread_.join();
  pause_previews();
}

}  // namespace mocap::runtime
