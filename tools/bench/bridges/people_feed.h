#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "base/result.h"
#include "bench/bridges/frame_times.h"
#include "model/description.h"
#include "model/snapshot.h"
#include "wire/zmq_publisher.h"

namespace mocap::bench {

/// A feed of people in T-pose who move along x by kStep_m for each frame, with all markers, on a free loopback port.
class PeopleFeed {
 public:
  static Result<PeopleFeed> open(const MarkerSet& set, int people, double rate_hz);

  const std::string& endpoint() const { return publisher_->endpoint(); }
  /// Sends frame `number`, exposed at its time.
  Status send(std::uint64_t number, const FrameTimes& times);

 private:
  PeopleFeed(std::unique_ptr<wire::ZmqPublisher> publisher, Snapshot at_origin)
      : publisher_(std::move(publisher)), at_origin_(std::move(at_origin)), sent_(at_origin_) {}

  std::unique_ptr<wire::ZmqPublisher> publisher_;
  Snapshot at_origin_;
  Snapshot sent_;
};

/// The poses and markers of all people of a description, in T-pose beside each other with their roots on the plane x =
/// 0.
Snapshot people_at_origin(const Description& description);
/// The same people moved along x.
void move_people(const Snapshot& at_origin, double x_m, Snapshot& into);

}  // namespace mocap::bench
