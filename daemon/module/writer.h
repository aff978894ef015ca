#pragma once

#include "base/result.h"
#include "model/snapshot.h"

namespace mocap {

/// Keeps snapshots in a file, or what is learnt of subjects. The side thread owns it and makes all calls.
class Writer {
 public:
  virtual ~Writer() = default;

  virtual Status write(const Snapshot& snapshot) = 0;

  /// A subject was fitted: from the snapshot on that bears the fit's description version.
  virtual Status learn(const SubjectFit& /*fit*/) { return {}; }

  /// False: it is there for the fits alone.
  virtual bool wants_snapshots() const { return true; }

  /// Everything is on its way to the disk; nothing is written afterwards.
  virtual Status finish() = 0;
};

}  // namespace mocap
