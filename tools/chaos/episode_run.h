#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "chaos/hash.h"
#include "chaos/invariants.h"
#include "chaos/run_episode.h"
#include "chaos/stage.h"
#include "chaos/step_daemon.h"
#include "chaos/take_desk.h"
#include "chaos/virtual_feed.h"

namespace mocap::chaos {

/// One run of an episode: moves the virtual clock from event to event, lets the faults happen and checks the
/// invariants.
class EpisodeRun {
 public:
  /// The episode and the sabotage outlive the run. `takes`: the folder of its takes.
  EpisodeRun(const Episode& episode, Stage stage, const std::filesystem::path& takes, const Sabotage& sabotage);

  Verdict run();

 private:
  void step_world();
  void play_until(Timestamp until);
  void handle(const Arrival& arrival);
  void follow_faults(double from_s, double to_s);
  void begin(const Fault& fault);
  void end(const Fault& fault);
  void reload(double amount);
  void order(std::uint32_t performer, const std::function<void(SubjectId)>& give);
  Description description_of_reload(const settings::DaemonSettings& next, const Handover& handover) const;
  void on_set(Snapshot& snapshot, const std::optional<SubjectFit>& fit, Timestamp now);
  void check(const Snapshot& snapshot);
  void check_recovery(const Snapshot& snapshot);
  void check_parts();
  void note(const std::string& invariant, const Finding& finding);
  bool is_stalled(Timestamp at) const;
  double seconds(Timestamp at) const;

  const Episode& episode_;
  const Sabotage& sabotage_;
  Stage stage_;
  FaultyCameras cameras_;
  Description description_;  // in force
  StepDaemon daemon_;
  VirtualFeed feed_;
  TakeDesk takes_;
  std::vector<std::uint32_t> cast_;        // by subject of the daemon: the performer
  std::deque<scoring::EvalFrame> truths_;  // the last instants
  std::optional<Snapshot> last_;
  Timestamp now_;
  std::optional<Failure> failure_;
  std::uint64_t sets_ = 0;
};

}  // namespace mocap::chaos
