#include "runtime/ptp_worker.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace mocap::runtime {
namespace ptp_worker_test {

class CountingClock : public PtpClock {
 public:
  Status measure() override {
    ++measured;
    measured.notify_all();
    if (measured == 2) return Error{ErrorCode::NotFound, "ptp4l has no master"};
    return {};
  }
  std::optional<PtpLine> line(Timestamp) const override { return std::nullopt; }
  std::atomic<int> measured{0};
};

TEST(PtpWorker, MeasuresAgainAfterAFailureUntilItIsStopped) {
  CountingClock clock;
  std::jthread thread([&](const std::stop_token& stop) { PtpWorker(clock).run(stop); });

  for (int seen = 0; seen < 3; seen = clock.measured) clock.measured.wait(seen);
  thread.request_stop();
  thread.join();

  EXPECT_GE(clock.measured, 3);
}

}  // namespace ptp_worker_test
}  // namespace mocap::runtime
