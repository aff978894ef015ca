#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "base/time.h"
#include "model/health.h"
#include "model/take/take_order.h"

namespace mocap::take {

/// The time that an order to start waits for, by its countdown or its time; at most zero: it starts at once.
Duration wait_of(const TakeOrder& order, Timestamp now);

/// A take that waits for its start: for the end of a countdown, a time or a timecode.
class WaitingStart {
 public:
  struct Due {
    TakeOrder order;
    Timestamp at;  ///< the instant at which the take starts
  };

  bool waits() const noexcept { return order_.has_value(); }

  /// Fails with InvalidArgument if the order has a timecode that does not exist, or there is no source of timecode.
  Status check(const TakeOrder& order) const;

  /// Stores the order until take_due() returns it; does not block. Replaces an order that waits. Returns a sentence for
  /// the operator. Fails as check().
  Result<std::string> begin(const TakeOrder& order, Timestamp now);
  void set_timecode(const TimecodeHealth& timecode, Timestamp now);
  /// The order whose instant has come; it no longer waits.
  std::optional<Due> take_due(Timestamp now);
  /// Returns whether an order waited.
  bool cancel();

 private:
  Result<Timecode> timecode_for(const TakeOrder& order) const;
  Timestamp due_by_timecode(Timestamp now) const;

  std::optional<TakeOrder> order_;
  Timestamp due_at_;  // max(): no timecode says when
  TimecodeHealth timecode_;
};

}  // namespace mocap::take
