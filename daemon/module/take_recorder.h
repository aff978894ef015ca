#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/time.h"
#include "model/blob.h"
#include "model/clock/timecode_health.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"
#include "model/take/belief.h"
#include "model/take/take_file.h"
#include "model/take/take_health.h"
#include "model/take/take_order.h"

namespace mocap {

/// Records takes on an operator's order, with what happened before the order.
///
/// Two threads use it: the intake thread hands over what was captured and never waits for the disk; the disk thread
/// writes the files.
class TakeRecorder {
 public:
  virtual ~TakeRecorder() = default;

  // For the intake thread.
  virtual void keep(const BlobFrame& frame) = 0;
  virtual void keep(const Snapshot& snapshot) = 0;
  virtual void keep(const Health& health) = 0;
  virtual void keep(const Belief& belief) = 0;
  /// A subject was fitted. The fit applies from the next snapshot on.
  virtual void learn(const SubjectFit& fit) = 0;
  /// Images and sets that were dropped before they reached the recorder, since the last call.
  virtual void count_dropped(std::uint64_t images, std::uint64_t sets) = 0;

  /// Another configuration is in force from now on. A take of the same cameras goes on; another one ends. `files`: what
  /// each later take carries. For the intake thread, or while it does not run.
  virtual void describe(const Description& description, std::vector<TakeFile> files, Timestamp now) = 0;

  // For the disk thread.
  virtual void follow(const TakeOrder& order) = 0;
  /// The state of the source of timecode, by which a take may start.
  virtual void set_timecode(const TimecodeHealth& timecode, Timestamp now) = 0;
  /// Writes what waits, and starts and ends takes that are due; a call that ends a take starts none. May wait for the
  /// disk. Returns whether the next call starts a take.
  virtual bool work(Timestamp now) = 0;
  /// The next answer to an order, if there is one.
  virtual std::optional<TakeDone> next_answer() = 0;
  virtual TakeHealth health() const = 0;
  /// Ends a take that is in progress; one that waits does not start. `why`: why it ends early; empty: the daemon ends.
  /// The last call.
  virtual void finish(Timestamp now, const std::string& why) = 0;
};

}  // namespace mocap
