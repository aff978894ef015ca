#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mocap/v1/health.pb.h"
#include "mocap/v1/snapshot.pb.h"
#include "mocap/v1/take.pb.h"
#include "model/blob.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"
#include "model/take/belief.h"
#include "model/take/take_file.h"
#include "take/mcap/compression.h"
#include "take/recorder/take_buffer.h"
#include "take/takes_settings.h"
#include "wire/event_watch.h"

namespace mocap::take {

/// The intake side of the recorder: encodes what is captured into the memory of takes, and remembers the descriptions
/// and files that were in force, so that a take may begin before its order.
class TakeIntake {
 public:
  /// Keeps the messages of the last `least_kept`, or of [takes] before_s if that is longer, and of the images of one
  /// set before.
  TakeIntake(const TakesSettings& settings, Duration least_kept, const Description& description,
             std::vector<TakeFile> files);

  // For the intake thread; see TakeRecorder.
  void keep(const BlobFrame& frame);
  void keep(const Snapshot& snapshot);
  void keep(const Health& health);
  void keep(const Belief& belief);
  void learn(const SubjectFit& fit);
  void count_dropped(std::uint64_t images, std::uint64_t sets);
  void describe(const Description& description, std::vector<TakeFile> files, Timestamp now);

  // For the disk thread.
  TakeBuffer& buffer() noexcept { return buffer_; }
  /// The description that was in force at an instant.
  Description description_at(Timestamp at) const;
  /// The files of the configuration in force.
  std::vector<TakeFile> files() const;
  /// Number of the first set of the run; empty: there was none yet.
  std::optional<std::uint64_t> first_set() const noexcept;
  /// What was dropped before it reached the recorder, since the start.
  struct Dropped {
    std::uint64_t images = 0, sets = 0;
  };
  Dropped dropped() const noexcept;

 private:
  static constexpr std::uint64_t kNoSet = ~std::uint64_t{0};

  void add_description(Timestamp at);
  void add_events();

  const bool keeps_blobs_;
  const Duration before_;
  TakeBuffer buffer_;
  std::atomic<std::uint64_t> dropped_images_{0}, dropped_sets_{0};
  std::atomic<std::uint64_t> first_set_{kNoSet};

  // Used by the intake thread only.
  Description description_;
  bool description_changed_ = false;
  wire::EventWatch events_;
  v1::CameraBlobs blobs_;
  v1::Snapshot snapshot_;
  v1::Health health_;
  v1::Belief belief_;
  mcap::Compressor compressor_{mcap::Compression::Zstd};
  std::string bytes_, description_bytes_;

  // Of both threads.
  mutable std::mutex mutex_;
  std::deque<std::pair<Timestamp, Description>> descriptions_;  // since when each is in force
  std::vector<TakeFile> files_;
};

}  // namespace mocap::take
