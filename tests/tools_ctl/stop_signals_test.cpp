#include "ctl/take/stop_signals.h"

#include <gtest/gtest.h>

#include <csignal>

namespace mocap::ctl {
namespace stop_signals_test {

TEST(StopSignals, AreCountedInsteadOfEndingTheProgram) {
  const StopSignals stops;
  EXPECT_EQ(stops.count(), 0);

  ::raise(SIGINT);
  ::raise(SIGTERM);

  EXPECT_EQ(stops.count(), 2);
}

TEST(StopSignals, BeginAtZeroAgain) {
  {
    const StopSignals before;
    ::raise(SIGTERM);
  }
  const StopSignals stops;

  EXPECT_EQ(stops.count(), 0);
  stops.end_program();  // does nothing
}

TEST(StopSignalsDeathTest, EndTheProgramAsTheLastOneWould) {
  EXPECT_EXIT(
      {
        const StopSignals stops;
        ::raise(SIGTERM);
        stops.end_program();
      },
      testing::KilledBySignal(SIGTERM), "");
}

TEST(StopSignalsDeathTest, EndTheProgramAtOnceIfTheyAreMany) {
  EXPECT_EXIT(
      {
        const StopSignals stops;
        for (int i = 0; i <= StopSignals::kMost; ++i) ::raise(SIGINT);
      },
      testing::KilledBySignal(SIGINT), "");
}

}  // namespace stop_signals_test
}  // namespace mocap::ctl
