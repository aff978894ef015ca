#include "lib/retrack/aligned_sets.h"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

namespace mocap::retrack {
namespace aligned_sets_test {

using std::chrono::microseconds;

BlobFrame image(std::uint32_t camera, std::uint64_t number, Duration after) {
  BlobFrame frame;
  frame.camera = CameraId{camera};
  frame.number = number;
  frame.exposed_at = from_ns(5'000'000'000) + after;
  frame.received_at = frame.detected_at = frame.exposed_at + std::chrono::seconds(9);  // late: nobody waits
  return frame;
}

TEST(AlignedSets, GroupAllImagesByTheirExposure) {
  AlignedSets sets({.window = microseconds(500)}, 3);
  for (const BlobFrame& frame : {image(0, 1, microseconds(0)), image(2, 1, microseconds(400)),
                                 image(1, 1, microseconds(700)), image(0, 2, microseconds(10'000))}) {
    sets.add(frame);
  }

  std::vector<std::size_t> views;
  std::vector<std::uint64_t> numbers;
  while (const auto set = sets.next(Timestamp::max())) {
    views.push_back(set->frames.views.size());
    numbers.push_back(set->frames.number);
    EXPECT_FALSE(set->recorded);
  }

  EXPECT_EQ(views, (std::vector<std::size_t>{2, 1, 1}));
  EXPECT_EQ(numbers, (std::vector<std::uint64_t>{0, 1, 2}));
}

TEST(AlignedSets, WaitForWhatWasNotReadYet) {
  AlignedSets sets({.window = microseconds(500)}, 2);
  sets.add(image(0, 1, microseconds(0)));

  EXPECT_FALSE(sets.next(image(0, 1, microseconds(500)).exposed_at)) << "an image of the other camera may come";
  EXPECT_TRUE(sets.next(image(0, 1, microseconds(501)).exposed_at));
}

}  // namespace aligned_sets_test
}  // namespace mocap::retrack
