#pragma once

#include <cstdint>
#include <optional>

#include "base/time.h"
#include "model/control.h"

namespace mocap {

/// Receives the requests of operators.
///
/// The control thread owns a ControlServer and makes all calls.
class ControlServer {
 public:
  virtual ~ControlServer() = default;

  /// Waits at most `patience` for the next request that is well formed and that its sender is permitted to make. The
  /// server answers all other requests itself.
  virtual std::optional<ControlRequest> next(Duration patience) = 0;

  /// Answers the request with this number, once, at any time after next() returned it. The answer is lost if the
  /// sender has disconnected.
  virtual void answer(std::uint64_t request, const ControlAnswer& answer) = 0;
};

}  // namespace mocap
