#include "runtime/runtime_settings.h"

#include <fmt/format.h>

namespace mocap::runtime {

void declare_capture_keys(KeyVisitor& keys, PipelineSettings& pipeline) {
  keys.flag("every_set", pipeline.fusion.every_set,
            {.help = "true: a late fusion processes every set; false: it skips to the newest ready set, one that "
                     "waits for no further image"});
}

void declare_publish_keys(KeyVisitor& keys, PipelineSettings& pipeline) {
  keys.flag("every_snapshot", pipeline.publish.every_snapshot,
            {.help = "true: a late publisher sends all snapshots that wait; false: only the newest"});
}

void declare_reopen_keys(KeyVisitor& keys, PipelineSettings& pipeline) {
  CameraWorkerSettings& camera = pipeline.camera;
  keys.time("silent_after_ms", camera.silent_after, {10, 60000},
            {.help = "a camera that gives no image for this time is reopened"});
  keys.time(
      "first_image_within_ms", camera.first_image_within, {10, 600000},
      {.help = "a camera is reopened, too, if its first image does not come within this time after a start, or if it "
               "gives only unusable images for this time"});
  keys.time("first_backoff_ms", camera.first_backoff, {1, 60000},
            {.help = "time before the first attempt; it doubles with each attempt"});
  keys.time("longest_backoff_ms", camera.longest_backoff, {1, 600000}, {.help = "longest time before an attempt"});
}

void declare_queues_keys(KeyVisitor& keys, PipelineSettings& pipeline) {
  keys.number("camera_frames", pipeline.camera_queue_frames, {2, 1024},
              {.help = "blobs of images that wait for the fusion thread, for each camera"});
  keys.number("publish_snapshots", pipeline.publish_queue_snapshots, {2, 1024},
              {.help = "snapshots that wait for the publish thread"});
  keys.number("side_snapshots", pipeline.side_queue_snapshots, {2, 4096},
              {.help = "snapshots that wait for the threads that write files and takes; 0.8 MB each"});
}

void declare_realtime_keys(KeyVisitor& keys, PipelineSettings& pipeline) {
  constexpr KeyRange kPriority{0, 99};
  constexpr KeyRange kCpu{0, 1023};  // CPU_SETSIZE
  keys.choice<Waiting>(
      "wait", pipeline.fusion.waiting, {{"sleep", Waiting::Sleep}, {"spin", Waiting::Spin}},
      {.help = "how idle threads wait; spin needs one core each for the fusion and the publish thread"});
  pipeline.publish.waiting = pipeline.fusion.waiting;
  keys.flag("lock_memory", pipeline.lock_memory,
            {.help = "true: all memory is kept out of swap; needs LimitMEMLOCK=infinity"});
  keys.number("camera_fifo_priority", pipeline.camera.thread.fifo_priority, kPriority,
              {.help = "SCHED_FIFO priority of each camera thread; 0: ordinary scheduling; needs LimitRTPRIO"});
  keys.whole_numbers("camera_cpus", pipeline.camera.thread.cpus, kCpu,
                     {.help = "processors of these threads; []: all"});
  keys.number("fusion_fifo_priority", pipeline.fusion.thread.fifo_priority, kPriority);
  keys.whole_numbers("fusion_cpus", pipeline.fusion.thread.cpus, kCpu);
  keys.number("publish_fifo_priority", pipeline.publish.thread.fifo_priority, kPriority);
  keys.whole_numbers("publish_cpus", pipeline.publish.thread.cpus, kCpu);
}

std::vector<KeyFault> reopen_faults_of(const PipelineSettings& pipeline) {
  const CameraWorkerSettings& camera = pipeline.camera;
  if (camera.first_backoff <= camera.longest_backoff) return {};
  return {{"first_backoff_ms", fmt::format("first_backoff_ms is {}, over longest_backoff_ms = {}",
                                           to_s(camera.first_backoff) * 1e3, to_s(camera.longest_backoff) * 1e3)}};
}

}  // namespace mocap::runtime
