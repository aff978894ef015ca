#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/time.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"
#include "wire/zmq_subscriber.h"

namespace mocap::watch {

/// What arrived: a snapshot's facts as the display and the summary need them.
struct LastSnapshot {
  std::uint64_t number = 0;
  Timestamp exposed_at;
  std::uint32_t views = 0;
  std::uint32_t expected_views = 0;
  std::uint32_t labelled = 0;  ///< measured or filled
  std::uint32_t measured = 0;
  std::uint32_t labels = 0;  ///< that the marker sets have
  std::uint32_t unlabelled = 0;
  std::vector<SubjectPhase> phases;  ///< by subject
};

/// Follows a feed: knows the last of each topic, counts what came and what was lost on the way. `now` is the host's
/// clock and is an argument.
class FeedState {
 public:
  /// Takes one message in. Gives the snapshot's message where it was one that could be read.
  const v1::Snapshot* take(const wire::FeedMessage& message, Timestamp now);

  const std::optional<Description>& description() const { return description_; }
  const std::optional<Health>& health() const { return health_; }
  /// The report before that, of the same run; absent until there are two.
  const std::optional<Health>& health_before() const { return health_before_; }
  const std::optional<LastSnapshot>& last() const { return last_; }
  Timestamp last_arrival() const { return last_arrival_; }

  std::uint64_t frames() const { return frames_; }
  std::uint64_t complete() const { return complete_; }
  std::uint64_t lost() const { return lost_; }                ///< gaps in the sequence of the topic
  std::uint64_t passed_over() const { return passed_over_; }  ///< sets that the daemon did not send
  std::uint64_t restarts() const { return restarts_; }        ///< the sequence began anew
  std::uint64_t unreadable() const { return unreadable_; }
  const std::string& last_fault() const { return last_fault_; }
  std::uint64_t tracking() const { return tracking_; }  ///< snapshots with a tracked subject
  std::uint64_t labelled() const { return labelled_; }  ///< markers, over all snapshots
  std::uint64_t labels_expected() const { return labels_expected_; }

  /// Snapshots a second over the last two seconds.
  double rate_hz(Timestamp now) const;

  /// Age of the data when it came, p in 0 to 1; absent when nothing came or the clocks cannot be compared.
  std::optional<Duration> age(double p) const;

 private:
  void take_snapshot(const std::string& payload, Timestamp now);
  void count_numbers(const v1::Snapshot& message);
  void take_description(const std::string& payload);
  void take_health(const std::string& payload);
  void note_fault(const std::string& what);

  std::optional<Description> description_;
  std::optional<Health> health_;
  std::optional<Health> health_before_;
  std::optional<LastSnapshot> last_;
  Timestamp last_arrival_{};
  v1::Snapshot message_;
  bool readable_ = false;
  std::uint64_t last_sequence_ = 0;
  std::uint64_t last_number_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t complete_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t passed_over_ = 0;
  std::uint64_t restarts_ = 0;
  std::uint64_t unreadable_ = 0;
  std::uint64_t tracking_ = 0;
  std::uint64_t labelled_ = 0;
  std::uint64_t labels_expected_ = 0;
  std::string last_fault_;
  std::vector<Timestamp> arrivals_;  // of the last two seconds, oldest first
  std::vector<Duration> ages_;       // the newest kAges, as a ring
  std::size_t next_age_ = 0;
};

}  // namespace mocap::watch
