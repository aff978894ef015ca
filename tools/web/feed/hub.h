#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/time.h"
#include "mocap/v1/description.pb.h"
#include "mocap/v1/health.pb.h"
#include "web/feed/listener.h"
#include "wire/client_link.h"
#include "wire/zmq_subscriber.h"

namespace mocap::web {

/// The connection to the daemon, as pages and machines see it.
struct FeedStatus {
  bool connected = false;  ///< the handshake succeeded, and data came within the last 3 s
  double age_s = 0.0;      ///< since the last message; since the start if none came
  std::string reason;      ///< why there is no connection, and what helps; empty if connected
};

/// Distributes the feed to the viewers. One thread.
class Hub {
 public:
  /// `started`: now. `endpoint`: of the feed, for explanations.
  Hub(std::string endpoint, Timestamp started) : endpoint_(std::move(endpoint)), started_(started) {}

  /// `viewer` must live until leave().
  void join(Listener& viewer) { viewers_.push_back(&viewer); }
  void leave(Listener& viewer);
  std::size_t viewer_count() const { return viewers_.size(); }

  /// Replaces the viewer's topics. It receives the current description and health at once.
  void subscribe(Listener& viewer, Topics topics);
  /// The topics that the program needs: description, health, event, and those that a viewer wants.
  Topics topics() const;

  void take(std::vector<wire::FeedMessage> messages, Timestamp now);
  /// When the connection ends, description and health are forgotten: the next daemon may have others.
  void note_link(const wire::LinkStatus& link);

  FeedStatus status(Timestamp now) const;
  const v1::Health* health() const { return health_ ? &*health_ : nullptr; }
  const v1::Description* description() const { return description_ ? &*description_ : nullptr; }
  const std::string& endpoint() const { return endpoint_; }
  /// Snapshots that viewers who left missed, and those of the viewers now.
  std::uint64_t dropped_snapshots() const;

 private:
  void keep(const wire::FeedMessage& message);

  std::string endpoint_;
  Timestamp started_;
  std::optional<Timestamp> arrived_;
  wire::LinkStatus link_;
  std::vector<Listener*> viewers_;
  std::uint64_t dropped_before_ = 0;
  std::optional<v1::Health> health_;
  std::optional<v1::Description> description_;
  std::shared_ptr<const std::string> health_message_;
  std::shared_ptr<const std::string> description_message_;
};

}  // namespace mocap::web
