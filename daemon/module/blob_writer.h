#pragma once

#include "base/result.h"
#include "model/blob.h"

namespace mocap {

/// Keeps what the cameras' detectors find in a file. One thread owns it and makes all calls.
class BlobWriter {
 public:
  virtual ~BlobWriter() = default;

  /// The images of one camera come in the order of their exposure.
  virtual Status write(const BlobFrame& frame) = 0;

  /// Everything is on its way to the disk; nothing is written afterwards.
  virtual Status finish() = 0;
};

}  // namespace mocap
