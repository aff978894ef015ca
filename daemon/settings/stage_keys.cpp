#include "settings/stage_keys.h"

namespace mocap::settings {
namespace {

using enum TimeUnit;

// A section is a function with a line a key: its name in the file, its field, its range. A new stage is such a
// function and a line in kSections.

void tell_capture(Keys& keys, DaemonSettings& all) {
  keys.path("rig", all.capture.rig_file);
  keys.number("rate_hz", all.capture.rate_hz, {0, 10000});
  keys.flag("every_set", all.pipeline.fusion.every_set);
  keys.flag("lossless", all.pipeline.lossless);
}

void tell_log(Keys& keys, DaemonSettings& all) {
  keys.choice<LogLevel>(
      "level", all.log_level,
      {{"debug", LogLevel::Debug}, {"info", LogLevel::Info}, {"warn", LogLevel::Warn}, {"error", LogLevel::Error}});
}

void tell_reopen(Keys& keys, DaemonSettings& all) {
  runtime::CameraWorkerSettings& camera = all.pipeline.camera;
  keys.time("silent_after_ms", camera.silent_after, Milliseconds, {10, 60000});
  keys.time("first_image_within_ms", camera.first_image_within, Milliseconds, {10, 600000});
  keys.time("first_backoff_ms", camera.first_backoff, Milliseconds, {1, 60000});
  keys.time("longest_backoff_ms", camera.longest_backoff, Milliseconds, {1, 600000});
}

void tell_detect(Keys& keys, DaemonSettings& all) {
  stages::DetectSettings& detect = all.detect;
  keys.number("threshold", detect.threshold, {1, 255});
  keys.number("low_threshold", detect.low_threshold, {0, 255});
  keys.number("min_area_px2", detect.min_area_px2, {1, 1e6});
  keys.number("max_area_px2", detect.max_area_px2, {1, 1e6});
  keys.number("min_roundness", detect.min_roundness, {0, 1});
  keys.number("grow_px", detect.grow_px, {0, 8});
}

void tell_align(Keys& keys, DaemonSettings& all) {
  keys.time("window_us", all.pipeline.align.window, Microseconds, {1, 1e6});
  keys.time("patience_us", all.pipeline.align.patience, Microseconds, {0, 1e7});
}

void tell_publish(Keys& keys, DaemonSettings& all) {
  keys.text("endpoint", all.publish.endpoint);
  keys.flag("allow_remote", all.publish.allow_remote);
  keys.number("send_queue", all.publish.send_queue, {1, 1000});
  keys.flag("every_snapshot", all.pipeline.publish.every_snapshot);
}

void tell_record(Keys& keys, DaemonSettings& all) { keys.path("snapshots", all.record.snapshots); }

void tell_queues(Keys& keys, DaemonSettings& all) {
  keys.number("camera_frames", all.pipeline.camera_queue_frames, {2, 1024});
  keys.number("publish_snapshots", all.pipeline.publish_queue_snapshots, {2, 1024});
  keys.number("side_snapshots", all.pipeline.side_queue_snapshots, {2, 4096});
}

void tell_realtime(Keys& keys, DaemonSettings& all) {
  constexpr Range kPriority{0, 99};
  constexpr Range kCpu{0, 1023};  // CPU_SETSIZE
  runtime::PipelineSettings& pipeline = all.pipeline;
  keys.choice<runtime::Waiting>("wait", pipeline.fusion.waiting,
                                {{"sleep", runtime::Waiting::Sleep}, {"spin", runtime::Waiting::Spin}});
  pipeline.publish.waiting = pipeline.fusion.waiting;
  keys.flag("lock_memory", all.lock_memory);
  keys.number("camera_fifo_priority", pipeline.camera.thread.fifo_priority, kPriority);
  keys.whole_numbers("camera_cpus", pipeline.camera.thread.cpus, kCpu);
  keys.number("fusion_fifo_priority", pipeline.fusion.thread.fifo_priority, kPriority);
  keys.whole_numbers("fusion_cpus", pipeline.fusion.thread.cpus, kCpu);
  keys.number("publish_fifo_priority", pipeline.publish.thread.fifo_priority, kPriority);
  keys.whole_numbers("publish_cpus", pipeline.publish.thread.cpus, kCpu);
}

constexpr Section kSections[] = {
    {"capture", tell_capture},  //
    {"log", tell_log},          //
    {"detect", tell_detect},    //
    {"align", tell_align},      //
    {"publish", tell_publish},  //
    {"record", tell_record},    //
    {"reopen", tell_reopen},    //
    {"queues", tell_queues},    //
    {"realtime", tell_realtime},
};

}  // namespace

std::span<const Section> sections() { return kSections; }

}  // namespace mocap::settings
