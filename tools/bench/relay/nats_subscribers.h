#pragma once

#include <nats/nats.h>

#include <atomic>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "bench/bridges/arrivals.h"

namespace mocap::bench {

/// Subscribers of a NATS server, each with a connection of its own. A thread of the library takes their messages and
/// notes when each had which frame of a lite topic.
class NatsSubscribers {
 public:
  /// Connects `arrivals.receivers()` subscribers, with TLS if `authority`, a file of certificates, is not empty. Fails
  /// with Io. `arrivals` must outlive this object.
  static Result<std::unique_ptr<NatsSubscribers>> open(const std::string& url, const std::string& authority,
                                                       const std::string& subject, Arrivals& arrivals);
  ~NatsSubscribers();
  NatsSubscribers(const NatsSubscribers&) = delete;
  NatsSubscribers& operator=(const NatsSubscribers&) = delete;

  /// Subscribers that got a frame.
  std::size_t joined() const { return joined_; }

 private:
  struct One {
    NatsSubscribers* all = nullptr;
    std::size_t index = 0;
    bool joined = false;
    natsConnection* connection = nullptr;
    natsSubscription* subscription = nullptr;
  };

  explicit NatsSubscribers(Arrivals& arrivals) : arrivals_(arrivals), each_(arrivals.receivers()) {}
  static void take(natsConnection* connection, natsSubscription* subscription, natsMsg* message, void* of);

  Arrivals& arrivals_;
  std::vector<One> each_;
  std::atomic<std::size_t> joined_ = 0;
};

}  // namespace mocap::bench
