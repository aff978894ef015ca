#include "take/recorder/take_intake.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "take/example_take.h"

namespace mocap::take {
namespace take_intake_test {

// The order of a take asks for the description while a reload replaces it.
TEST(TakeIntake, HasADescriptionAtEachInstantOfAReloadWithOtherCameras) {
  Description one = example_description(), other = one;
  other.cameras.pop_back();
  TakeIntake intake({}, Duration::zero(), one, {});
  std::atomic<bool> ended{false};
  std::atomic<int> without_cameras{0};
  std::jthread orders([&] {
    while (!ended) {
      if (intake.description_at(Timestamp::max()).cameras.empty()) ++without_cameras;
    }
  });

  for (int i = 0; i < 1000; ++i) intake.describe(i % 2 == 0 ? other : one, {}, example_time(static_cast<unsigned>(i)));
  ended = true;
  orders.join();

  EXPECT_EQ(without_cameras, 0);
  EXPECT_EQ(intake.description_at(Timestamp::max()).cameras.size(), one.cameras.size());
  EXPECT_EQ(intake.description_at(Timestamp::min()).cameras.size(), one.cameras.size());
}

}  // namespace take_intake_test
}  // namespace mocap::take
