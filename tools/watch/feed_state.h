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

/// The facts of the last snapshot that the display and the summary need.
struct LastSnapshot {
  std::uint64_t number = 0;
  Timestamp exposed_at;
  std::uint32_t views = 0;
  std::uint32_t expected_views = 0;
  std::uint32_t labelled = 0;  ///< measured or filled
  std::uint32_t measured = 0;
  std::uint32_t labels = 0;  ///< labels of all marker sets
  std::uint32_t unlabelled = 0;
  std::vector<SubjectPhase> phases;  ///< indexed by subject
};

/// Tracks the state of a feed: the last message of each topic, and counts of received and lost messages. Times are on
/// the host's monotonic clock and are arguments.
class FeedState {
 public:
  /// Processes one message. Returns the snapshot message if the message is a valid snapshot, else null. The pointer is
  /// valid until the next call.
  const v1::Snapshot* take(const wire::FeedMessage& message, Timestamp now);

  /// Counts a message that the source of the messages could not read.
  void note_fault(const std::string& what);

  const std::optional<Description>& description() const { return description_; }
  const std::optional<Health>& health() const { return health_; }
  /// The health report before the last one, if both are from the same run of the daemon.
  const std::optional<Health>& health_before() const { return health_before_; }
  const std::optional<LastSnapshot>& last() const { return last_; }
  Timestamp last_arrival() const { return last_arrival_; }

  std::uint64_t frames() const { return frames_; }
  std::uint64_t complete() const { return complete_; }
  std::uint64_t lost() const { return lost_; }                ///< missing sequence numbers of the topic
  std::uint64_t passed_over() const { return passed_over_; }  ///< sets that the daemon skipped
  std::uint64_t restarts() const { return restarts_; }        ///< how often the sequence restarted
  std::uint64_t unreadable() const { return unreadable_; }
  const std::string& last_fault() const { return last_fault_; }
  std::uint64_t tracking() const { return tracking_; }  ///< number of snapshots with a tracked subject
  std::uint64_t labelled() const { return labelled_; }  ///< labelled markers, summed over all snapshots
  std::uint64_t labels_expected() const { return labels_expected_; }

  /// Snapshot rate over the last two seconds, Hz.
  double rate_hz(Timestamp now) const;

  /// The quantile `p` (0 to 1) of the age of the data on arrival. Absent without snapshots or if the clocks cannot be
  /// compared.
  std::optional<Duration> age(double p) const;

 private:
  void take_snapshot(const std::string& payload, Timestamp now);
  void count_numbers(const v1::Snapshot& message);
  void take_description(const std::string& payload);
  void take_health(const std::string& payload);

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
  std::vector<Timestamp> arrivals_;  // arrivals in the last two seconds, oldest first
  std::vector<Duration> ages_;       // ring buffer of the newest kAges ages
  std::size_t next_age_ = 0;
};

}  // namespace mocap::watch
