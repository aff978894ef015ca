#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "bridges/relay/nats_link.h"
#include "bridges/relay/newest.h"
#include "bridges/status/statistics.h"
#include "bridges/status/status_file.h"
#include "wire/zmq_subscriber.h"

namespace mocap::relay {

struct RelaySettings {
  wire::SubscriberSettings feed;
  NatsSettings nats;
  std::string prefix = "studio";
  double statistics_s = 0.0;     ///< interval of the statistics in the log; 0: none
  double seconds = 0.0;          ///< end after this time; 0: never
  std::string status_file = {};  ///< see StatusFile
};

/// Forwards topics of a feed to a NATS server until SIGINT, SIGTERM or the end of the time.
class Relay {
 public:
  /// Starts to connect to both. Fails with InvalidArgument if a setting is invalid.
  static Result<std::unique_ptr<Relay>> open(const RelaySettings& settings);

  /// Returns the exit code: 0, or 69 if nothing was forwarded in settings.seconds.
  int run();

 private:
  Relay(const RelaySettings& settings, std::unique_ptr<wire::ZmqSubscriber> feed, std::unique_ptr<NatsLink> nats);

  void receive();
  void take(wire::FeedMessage message, Timestamp now);
  void count_lost(const wire::FeedMessage& message);
  void forward();
  const std::string& subject_for(const std::string& topic);
  void tick(Timestamp now);
  std::string diagnosis() const;
  void say_changes(Timestamp now);
  void write_status(Timestamp now);

  RelaySettings settings_;
  std::unique_ptr<wire::ZmqSubscriber> feed_;
  std::unique_ptr<NatsLink> nats_;
  Newest newest_;
  bridge::Statistics counts_;
  bridge::StatusFile status_;
  std::unordered_map<std::string, std::string> subjects_;         // by topic
  std::unordered_map<std::string, std::uint32_t> next_sequence_;  // by topic lite/NAME
  std::uint64_t feed_lost_ = 0;
  std::uint64_t refused_ = 0;  // messages that the link did not take
  Timestamp started_ = host_now();
  Timestamp last_message_ = started_;
  Timestamp next_tick_ = started_;
  Timestamp next_log_ = started_;
  bool silent_ = true;
  std::string said_;
};

}  // namespace mocap::relay
