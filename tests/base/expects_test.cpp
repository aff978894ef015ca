#include "base/expects.h"

#include <gtest/gtest.h>

#include <csignal>

namespace mocap {
namespace expects_test {

TEST(Expects, EvaluatesATrueConditionOnceAndContinues) {
  int evaluations = 0;

  MOCAP_EXPECTS(++evaluations == 1);

  EXPECT_EQ(evaluations, 1);
}

TEST(ExpectsDeathTest, AbortsWithFileAndTextOfAFalseCondition) {
  const int cameras = 65;

  // Tests are built with and without optimisation: the condition is checked in both.
  EXPECT_EXIT(MOCAP_EXPECTS(cameras <= 64), testing::KilledBySignal(SIGABRT),
              "expects_test\\.cpp:[0-9]+: violated precondition: cameras <= 64");
}

}  // namespace expects_test
}  // namespace mocap
