#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "bridges/lib/descriptor.h"
#include "mocap_client.hpp"

namespace mocap::bridge {

/// The feed as a file descriptor for an EventLoop. The client's thread makes the descriptor readable; the loop's thread
/// takes the frames.
class FeedSource {
 public:
  /// Starts to connect; the daemon need not run yet. Returns nullptr if an option is invalid, with the reason in
  /// `fault`.
  static std::unique_ptr<FeedSource> open(ClientOptions options, std::string& fault);
  FeedSource(const FeedSource&) = delete;
  FeedSource& operator=(const FeedSource&) = delete;

  int descriptor() const { return wake_.number(); }
  /// Makes the descriptor unreadable until the next message. Call before next().
  void acknowledge();
  /// Copies the next frame to `frame`; false: there is none yet. Never waits.
  bool next(ClientFrame& frame) const { return client_->poll(frame); }
  /// Time at which the newest message came to this program, ns on the monotonic clock; 0: none came.
  std::int64_t arrived_ns() const { return arrived_ns_; }
  const Client& client() const { return *client_; }

 private:
  explicit FeedSource(Descriptor wake) : wake_(std::move(wake)) {}
  void note_message();

  Descriptor wake_;
  std::atomic<std::int64_t> arrived_ns_ = 0;
  std::optional<Client> client_;  // the last member: its thread calls note_message()
};

/// Now, ns on the monotonic clock, which is the daemon's clock on the same machine.
std::int64_t monotonic_ns();

}  // namespace mocap::bridge
