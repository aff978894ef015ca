#include "chaos/shrink.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace mocap::chaos {
namespace shrink_test {

std::vector<Fault> faults_at(std::vector<double> times_s) {
  std::vector<Fault> faults;
  for (const double at_s : times_s) faults.push_back({FaultKind::FramesLost, at_s, 1.0, 0, 0.5});
  return faults;
}

bool has(const std::vector<Fault>& faults, double at_s) {
  return std::ranges::any_of(faults, [&](const Fault& fault) { return fault.from_s == at_s; });
}

TEST(Shrink, LeavesTheFaultsThatAreNeededTogetherInTheirOrder) {
  const auto fails = [](const std::vector<Fault>& faults) { return has(faults, 2.0) && has(faults, 7.0); };

  EXPECT_EQ(shrink(faults_at({1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0}), fails), faults_at({2.0, 7.0}));
}

TEST(Shrink, LeavesNothingIfTheRunFailsWithoutFaults) {
  EXPECT_TRUE(shrink(faults_at({1.0, 2.0, 3.0}), [](const auto&) { return true; }).empty());
}

TEST(Shrink, LeavesAllIfAllAreNeeded) {
  const std::vector<Fault> all = faults_at({1.0, 2.0, 3.0, 4.0, 5.0});

  EXPECT_EQ(shrink(all, [&](const std::vector<Fault>& faults) { return faults.size() == all.size(); }), all);
}

}  // namespace shrink_test
}  // namespace mocap::chaos
