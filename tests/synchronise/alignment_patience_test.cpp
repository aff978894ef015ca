// Tests for which cameras a set waits, and how long.
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "synchronise/alignment_world.h"
#include "synchronise/frame_aligner.h"

namespace mocap::synchronise {
namespace alignment_patience_test {

using std::chrono::microseconds;

TEST(FrameAligner, StopsWaitingForAStoppedCameraAndResumesWhenItIsInTime) {
  FrameAligner aligner(kSettings, 2);
  for (int i = 0; i < 4; ++i) {
    aligner.add(seen_by(0, 1000 + 8000 * i));
    EXPECT_FALSE(aligner.take(at(2999 + 8000 * i)));
    ASSERT_TRUE(aligner.take(at(3000 + 8000 * i)));
  }
  aligner.add(seen_by(0, 33'000));
  EXPECT_TRUE(aligner.take(at(33'000))) << "camera 1 is not waited for any more";

  aligner.add(seen_by(1, 33'000, 2500));
  aligner.add(seen_by(0, 41'000));
  EXPECT_TRUE(aligner.take(at(41'000))) << "a frame that comes too late for any set is no reason to wait";

  aligner.add(seen_by(1, 41'000, 1500));
  EXPECT_EQ(aligner.counts().late, 2U) << "its set was returned already";
  aligner.add(seen_by(0, 49'000));
  EXPECT_FALSE(aligner.take(at(50'000))) << "its last frame would have been in time";
  aligner.add(seen_by(1, 49'000, 1500));
  const auto set = aligner.take(at(50'500));
  ASSERT_TRUE(set);
  EXPECT_EQ(set->views.size(), 2U);
}

TEST(FrameAligner, StopsWaitingIfTheQueueOfACameraIsFull) {
  FrameAligner aligner({.window = microseconds(500), .patience = std::chrono::seconds(1)}, 2);
  for (int i = 0; i < 8; ++i) {
    EXPECT_FALSE(aligner.take(at(8000 * i)));
    aligner.add(seen_by(0, 1000 + 8000 * i));
  }

  EXPECT_FALSE(aligner.take(kForever)) << "in a replay the other camera's frames will come";
  EXPECT_TRUE(aligner.take(at(57'000)));
}

TEST(FrameAligner, DoesNotWaitForASlowerCameraIfNoFrameIsDue) {
  FrameAligner aligner({.window = microseconds(500), .patience = std::chrono::milliseconds(20)}, 2);
  const auto run = [&](int from, int to) {
    int waited = 0;
    for (int i = from; i < to; ++i) {
      if (i % 2 == 0) aligner.add(seen_by(1, 10'000 * i));
      aligner.add(seen_by(0, 10'000 * i));
      waited += aligner.take(at(10'000 * i)) ? 0 : 1;
      while (aligner.take(at(10'000 * i + 9'999))) continue;
    }
    return waited;
  };
  EXPECT_GT(run(0, 600), 0) << "its frame rate is not known yet";
  aligner.assess_timing();

  EXPECT_EQ(run(600, 700), 0);
}

}  // namespace alignment_patience_test
}  // namespace mocap::synchronise
