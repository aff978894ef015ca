#pragma once

#include <stop_token>
#include <string>

#include "module/ptp_clock.h"

namespace mocap::runtime {

/// The PTP thread: measures this machine's clock every second and logs when the measurement begins or ends to work. A
/// machine without PTP is normal: it is logged once as a message.
class PtpWorker {
 public:
  /// `clock` outlives the worker.
  explicit PtpWorker(PtpClock& clock) : clock_(clock) {}

  /// The loop; returns when stopped, after a measurement of at most a second.
  void run(const std::stop_token& stop);

 private:
  void report(const Status& measured);

  PtpClock& clock_;
  std::string reported_ = "?";  // the fault; empty: none
};

}  // namespace mocap::runtime
