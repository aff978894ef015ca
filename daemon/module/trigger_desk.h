#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/time.h"
#include "model/take/take_news.h"
#include "model/take/take_order.h"
#include "module/datagram_port.h"

namespace mocap {

/// The actions that a TriggerDesk asks for.
struct TriggerActions {
  struct Line {
    bool refused = false;
    std::string text;
  };

  std::optional<TakeOrder> order;  ///< for the recorder; its number is the desk's
  std::vector<Datagram> packets;   ///< to be sent
  std::vector<Line> lines;         ///< for the log
};

/// Decides what remote triggers do: reads their packets, orders takes, answers, and tells others about takes. Opens
/// nothing and reads no clock. One thread.
class TriggerDesk {
 public:
  virtual ~TriggerDesk() = default;

  /// Processes one untrusted packet: a request of a sender, or an answer of a receiver. Never fails: a packet that is
  /// refused causes at most a log line and a negative answer. `now`: on the host's monotonic clock.
  virtual TriggerActions receive(const Datagram& datagram, Timestamp now) = 0;

  /// The recorder answered an order, is executing one, or has another take.
  virtual TriggerActions hear(const TakeNews& news, Timestamp now) = 0;
};

}  // namespace mocap
