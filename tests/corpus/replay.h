#pragma once

#include <cstdint>
#include <optional>

#include "chaos/episode.h"
#include "chaos/hash.h"
#include "chaos/step_daemon.h"
#include "chaos/take_desk.h"
#include "chaos/virtual_feed.h"
#include "corpus/figures.h"
#include "corpus/recording.h"
#include "lib/scoring/frames.h"
#include "settings/daemon_settings.h"
#include "support/temporary_folder.h"

namespace mocap::corpus {

/// Hands the inputs of a recording to the daemon's steps in the order of their times, and judges the snapshots.
class Replay {
 public:
  /// The recording outlives the replay. Its inputs name cameras and subjects of the settings.
  Replay(const Recording& recording, settings::DaemonSettings settings);

  /// One call.
  Figures run();

 private:
  void wait_until(Timestamp until);
  void handle(const Input& input);
  void follow(const Order& order);
  void reload(OrderKind kind);
  void on_set(Snapshot& snapshot, const std::optional<SubjectFit>& fit, Timestamp now);
  void judge(const Snapshot& snapshot);
  void judge(const scoring::NamedMarker& marker, const Truth& truth);
  const Truth* truth_at(Timestamp at) const;
  double seconds(Timestamp at) const;
  std::string fault() const;

  const Recording& recording_;
  chaos::Episode episode_;  // of the feed: its faults and their seed
  support::TemporaryFolder folder_;
  Description description_;  // in force
  Timestamp now_;
  Figures figures_;
  double squares_m2_ = 0.0;
  chaos::Hash hash_;
  chaos::StepDaemon daemon_;
  chaos::VirtualFeed feed_;
  chaos::TakeDesk takes_;
};

}  // namespace mocap::corpus
