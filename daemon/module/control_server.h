#pragma once

#include <optional>

#include "base/time.h"
#include "model/control.h"

namespace mocap {

/// Where operators' requests come from. The control thread owns it and makes all calls.
class ControlServer {
 public:
  virtual ~ControlServer() = default;

  /// Waits for the next request that can be read and that its sender may make, `patience` at most; the others are
  /// answered here. Call `answer` before the next one.
  virtual std::optional<ControlRequest> next(Duration patience) = 0;

  /// To whoever sent the last request; lost where they are gone.
  virtual void answer(const ControlAnswer& answer) = 0;
};

}  // namespace mocap
