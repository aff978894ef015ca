#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "base/key_visitor.h"
#include "base/time.h"
#include "synchronise/align_settings.h"

namespace mocap::runtime {

// Help, units and ranges of the keys: the tables in runtime_settings.cpp.

/// Treatment of one thread by the operating system.
struct ThreadSettings {
  int fifo_priority = 0;
  std::vector<int> cpus;  ///< empty: all
};

/// How an idle thread waits.
enum class Waiting {
  Sleep,  ///< on a futex; other threads can use the core
  Spin,   ///< polls without sleeping; needs a core of its own
};

/// [reopen]: a camera that failed or delivers no images.
struct CameraWorkerSettings {
  Duration silent_after = std::chrono::milliseconds(500);
  Duration first_image_within = std::chrono::seconds(5);  ///< after a start, and after the first of unusable images
  Duration first_backoff = std::chrono::milliseconds(250);
  Duration longest_backoff = std::chrono::milliseconds(2000);
  bool lossless = false;  ///< no key: waits for free space instead of dropping (replay)
  ThreadSettings thread;
};

struct FusionWorkerSettings {
  bool every_set = false;
  bool lossless = false;  ///< no key: waits for free space, and for the frames of every camera (replay)
  Waiting waiting = Waiting::Sleep;
  ThreadSettings thread;
};

struct PublishWorkerSettings {
  bool every_snapshot = false;
  bool lossless = false;  ///< no key: sends all snapshots, and signals free space (replay)
  Waiting waiting = Waiting::Sleep;
  Duration report_every = std::chrono::seconds(1);  ///< no key
  ThreadSettings thread;
};

/// The threads of a pipeline and the queues between them: [reopen], [queues], [realtime], and keys of [capture] and
/// [publish].
struct PipelineSettings {
  CameraWorkerSettings camera;                 ///< its `lossless` is taken from the pipeline's
  std::vector<ThreadSettings> camera_threads;  ///< no key: by CameraId; empty: camera.thread for all
  FusionWorkerSettings fusion;
  PublishWorkerSettings publish;
  synchronise::AlignSettings align;
  std::size_t camera_queue_frames = 8;
  std::size_t publish_queue_snapshots = 8;
  std::size_t side_queue_snapshots = 64;
  std::size_t record_queue_frames = 64;  ///< no key: for each camera, if blobs are recorded
  bool lock_memory = false;
  /// No key. The run is a replay: nothing is dropped, every thread waits for free space, and the clock is that of the
  /// recording. The snapshots depend on the frames alone.
  bool lossless = false;
};

/// Each function declares the keys of one section.
void declare_capture_keys(KeyVisitor& keys, PipelineSettings& pipeline);
void declare_publish_keys(KeyVisitor& keys, PipelineSettings& pipeline);
void declare_reopen_keys(KeyVisitor& keys, PipelineSettings& pipeline);
void declare_queues_keys(KeyVisitor& keys, PipelineSettings& pipeline);
void declare_realtime_keys(KeyVisitor& keys, PipelineSettings& pipeline);

/// Returns the faults that concern several keys of [reopen].
std::vector<KeyFault> reopen_faults_of(const PipelineSettings& pipeline);

}  // namespace mocap::runtime
