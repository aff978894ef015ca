#pragma once

#include "base/result.h"
#include "model/snapshot.h"

namespace mocap {

/// Keeps snapshots in a file. The side thread owns it and makes all calls.
class Writer {
 public:
  virtual ~Writer() = default;

  virtual Status write(const Snapshot& snapshot) = 0;

  /// Everything is on its way to the disk; nothing is written afterwards.
  virtual Status finish() = 0;
};

}  // namespace mocap
