#pragma once

#include <cstdint>
#include <optional>

#include "model/take/take_health.h"
#include "model/take/take_order.h"

namespace mocap {

/// A change of the take in progress, for those who follow it. Has an answer or the take, and the take with every answer
/// Done.
struct TakeNews {
  std::uint64_t order = 0;         ///< of the follower: the order that is being executed, or is answered; 0: none
  std::optional<TakeDone> done;    ///< the answer to `order`; none: the order is being executed
  std::optional<TakeHealth> take;  ///< after the change; none: as before
};

}  // namespace mocap
