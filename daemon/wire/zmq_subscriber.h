#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "wire/curve_keys.h"

namespace mocap::wire {

/// One message of a feed.
struct FeedMessage {
  std::string topic;
  std::string payload;  ///< Protobuf
};

struct SubscriberSettings {
  std::string endpoint = "tcp://127.0.0.1:5570";
  std::vector<std::string> topics = {"description", "snapshot", "health"};
  std::string server_key = {};  ///< the server's public key; empty: no CURVE
  KeyPair own_key = {};         ///< with CURVE: who we are
  int receive_queue = 1000;     ///< messages that wait here; who wants every message asks for more
};

/// What is known of the other side.
struct LinkStatus {
  bool connected = false;               ///< the handshake is through
  std::uint64_t connections = 0;        ///< how often it was
  std::uint64_t refused = 0;            ///< attempts that found nobody
  std::uint64_t failed_handshakes = 0;  ///< somebody was there who is no feed
};

/// Listens to a feed; connects again by itself. For tools and tests: allocates. One thread owns it.
class ZmqSubscriber {
 public:
  /// Begins to connect; nobody need be there yet. Fails with InvalidArgument (an endpoint that is none) and Io.
  static Result<std::unique_ptr<ZmqSubscriber>> open(const SubscriberSettings& settings);
  ~ZmqSubscriber();

  /// The oldest message that waits. Fails with Timeout when none came within `patience` (a signal ends it early), with
  /// InvalidArgument when one came that is no message of a feed (the next may be), and with Io.
  Result<FeedMessage> next(Duration patience);

  const LinkStatus& link() const;

 private:
  struct Impl;
  explicit ZmqSubscriber(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mocap::wire
