#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "wire/client_link.h"
#include "wire/curve_keys.h"

namespace mocap::wire {

/// One message of a feed.
struct FeedMessage {
  std::string topic;
  std::string payload;  ///< Protobuf
};

struct SubscriberSettings {
  std::string endpoint = "tcp://127.0.0.1:5570";
  /// "lite/*": all topics that begin with "lite/".
  std::vector<std::string> topics = {"description", "snapshot", "health"};
  ClientKeys keys = {};
  int receive_queue = 1000;  ///< messages that wait in the client; further messages are dropped
};

/// Receives a feed; reconnects automatically, also after the daemon rejected its key. For tools and tests: allocates.
/// One thread owns it.
class ZmqSubscriber {
 public:
  /// Starts to connect; the feed may start later. Fails with InvalidArgument (a malformed endpoint) and Io.
  static Result<std::unique_ptr<ZmqSubscriber>> open(const SubscriberSettings& settings);
  ~ZmqSubscriber();

  /// Returns the oldest waiting message. Fails with Timeout if none came within `patience` (a signal ends the wait
  /// early), with InvalidArgument if the message is not a message of a feed (the next message may be valid), and with
  /// Io.
  Result<FeedMessage> next(Duration patience);

  /// Replaces the list of topics, without a new connection.
  Status subscribe(std::vector<std::string> topics);

  const LinkStatus& link() const;

 private:
  struct Impl;
  explicit ZmqSubscriber(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mocap::wire
