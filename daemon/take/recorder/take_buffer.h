#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "base/time.h"

namespace mocap::take {

enum class BufferedKind : std::uint32_t {
  Blobs,
  Snapshot,
  Description,
  Health,
  Event,
  Belief,  ///< `v1::Belief` without sets and images
  Break,   ///< other cameras from here on: no take goes beyond
};

/// One encoded message.
struct BufferedMessage {
  BufferedKind kind = BufferedKind::Blobs;
  std::uint32_t camera = 0;  ///< of Blobs
  Timestamp at;
  std::string_view bytes;
};

/// A ring buffer of fixed size with the encoded messages of the last seconds.
///
/// One thread adds messages and never waits for a disk; a second thread reads the messages of a take. A message is
/// removed when it is older than `keep` and the take does not need it. If the buffer is full, the oldest messages are
/// removed in any case; those that the take had not read yet are counted in lost().
class TakeBuffer {
 public:
  TakeBuffer(std::size_t capacity_bytes, Duration keep);

  void add(const BufferedMessage& message);

  /// From now on a take needs the messages from `from` on. Returns the time of the oldest one that is there.
  std::optional<Timestamp> hold(Timestamp from);
  void release();

  /// Copies waiting messages of the take, oldest first, about `most_bytes`; empty: none waits. The views are valid
  /// until the next call. Only the thread that holds calls it.
  const std::vector<BufferedMessage>& next(std::size_t most_bytes);

  struct Lost {
    std::uint64_t images = 0;
    std::uint64_t others = 0;
  };
  /// Messages that the full buffer removed or refused, since the last hold(), before the take had read them.
  Lost lost() const;

 private:
  struct Head {
    std::uint32_t size = 0;  ///< of the bytes
    std::uint32_t camera = 0;
    BufferedKind kind = BufferedKind::Blobs;
    std::uint32_t skip = 0;  ///< 1: the rest of the memory is empty; go on at its start
    Timestamp at;
  };

  std::size_t room() const { return capacity_ - static_cast<std::size_t>(end_ - begin_); }
  Head head_at(std::uint64_t position) const;
  std::uint64_t after(std::uint64_t position, const Head& head) const;
  void evict();
  void put(const Head& head, std::string_view bytes);
  const char* bytes_at(std::uint64_t position) const;

  const std::size_t capacity_;
  const Duration keep_;
  std::unique_ptr<char[]> memory_;  // not initialised: pages that were never used cost nothing
  mutable std::mutex mutex_;        // guards all below
  std::uint64_t begin_ = 0;         // positions count all bytes since the start
  std::uint64_t end_ = 0;
  std::uint64_t cursor_ = 0;  // of the take
  bool held_ = false;
  Lost lost_;

  // Used by the reading thread only.
  std::vector<char> copied_;
  std::vector<BufferedMessage> batch_;
};

}  // namespace mocap::take
