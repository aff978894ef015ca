#include "bench/program.h"

#include <gtest/gtest.h>

#include <chrono>

namespace program_test {

using mocap::bench::Program;

template <class Condition>
bool wait_for(Condition condition) {
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition() && std::chrono::steady_clock::now() < limit) {
  }
  return condition();
}

TEST(Program, RunsUntilItsObjectEnds) {
  Program program("mocap-vmc", {"tcp://127.0.0.1:1", "--to", "127.0.0.1:9"});

  EXPECT_TRUE(program.runs());
  EXPECT_TRUE(wait_for([&] { return program.cpu_s() > 0.0; }));
}

TEST(Program, OneThatEndsByItselfNoLongerRuns) {
  Program program("mocap-vmc", {"--to", ""});

  EXPECT_TRUE(wait_for([&] { return !program.runs(); }));
  EXPECT_EQ(program.cpu_s(), 0.0);
}

TEST(Program, OneThatDoesNotExistDoesNotRun) {
  Program program("mocap-none", {});

  EXPECT_FALSE(program.runs());
}

}  // namespace program_test
