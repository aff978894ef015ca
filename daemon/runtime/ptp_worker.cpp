#include "runtime/ptp_worker.h"

#include <condition_variable>
#include <mutex>

#include "base/log.h"
#include "base/time.h"

namespace mocap::runtime {
namespace {

constexpr const char* kPtp = "ptp";
constexpr Duration kEvery = std::chrono::seconds(1);

}  // namespace

void PtpWorker::run(const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any stopped;
  std::unique_lock<std::mutex> lock(mutex);
  while (!stop.stop_requested()) {
    report(clock_.measure());
    stopped.wait_for(lock, stop, kEvery, [] { return false; });
  }
}

void PtpWorker::report(const Status& measured) {
  const std::string fault = measured ? std::string{} : measured.error().message;
  if (fault == reported_) return;
  reported_ = fault;
  if (measured) return log_info(kPtp, "the clock of this machine is measured by ptp4l");
  if (measured.error().code == ErrorCode::NotFound) return log_info(kPtp, fault + "; clocks of nodes are estimated");
  log_warn(kPtp, fault);
}

}  // namespace mocap::runtime
