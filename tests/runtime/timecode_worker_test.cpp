#include "runtime/timecode_worker.h"

#include <gtest/gtest.h>

#include <thread>

namespace mocap::runtime {
namespace timecode_worker_test {

// Has a timecode from the third state on; ends the worker with the tenth.
class CountingSource : public TimecodeSource {
 public:
  explicit CountingSource(std::stop_source& stop) : stop_(stop) {}
  void listen(Duration) override {}
  TimecodeHealth state(Timestamp now) override {
    TimecodeHealth health;
    health.source = TimecodeSourceKind::Ltc;
    health.frames = ++states_;
    if (states_ >= 3) {
      health.state = TimecodeState::Locked;
      health.clock = TimecodeClock{};
      health.clock->at = now;
    }
    if (states_ == 10) stop_.request_stop();
    return health;
  }

 private:
  std::stop_source& stop_;
  std::uint64_t states_ = 0;
};

TEST(TimecodeWorker, PassesTheStateToEveryThreadAndDropsWhatNobodyTakes) {
  std::stop_source stop;
  TimecodeChannel channel;
  TimecodeWorker worker(std::make_unique<CountingSource>(stop), channel);

  worker.run(stop.get_token());

  std::vector<std::uint64_t> published, taken;
  TimecodeHealth health;
  while (channel.to_publish.try_pop(health)) published.push_back(health.frames);
  while (channel.to_takes.try_pop(health)) taken.push_back(health.frames);
  const std::vector<std::uint64_t> expected{1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  EXPECT_EQ(published, expected);
  EXPECT_EQ(taken, expected);
  std::vector<bool> clocks;
  std::optional<TimecodeClock> clock;
  while (channel.to_fusion.try_pop(clock)) clocks.push_back(clock.has_value());
  EXPECT_EQ(clocks, (std::vector<bool>{false, false, true, true}));
}

}  // namespace timecode_worker_test
}  // namespace mocap::runtime
