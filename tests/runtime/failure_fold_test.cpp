#include "runtime/camera/failure_fold.h"

#include <gtest/gtest.h>

namespace mocap::runtime {
namespace failure_fold_test {

using std::chrono::seconds;

const Timestamp kBegun = from_ns(1'000'000'000'000);

TEST(FailureFold, LogsOneReasonOnceForAllCamerasAndAgainAfterAMinute) {
  FailureFold fold;

  EXPECT_TRUE(fold.is_news("node 'left' does not answer", kBegun));
  for (int camera = 1; camera < 8; ++camera) {
    EXPECT_FALSE(fold.is_news("node 'left' does not answer", kBegun + seconds(camera)));
  }
  EXPECT_TRUE(fold.is_news("node 'right' does not answer", kBegun + seconds(9)));
  EXPECT_TRUE(fold.is_news("node 'left' does not answer", kBegun + seconds(60)));
  EXPECT_FALSE(fold.is_news("node 'left' does not answer", kBegun + seconds(61)));
}

TEST(FailureFold, LogsTheNextFailureAfterTheEndOfOne) {
  FailureFold fold;
  EXPECT_TRUE(fold.is_news("node 'left' does not answer", kBegun));

  fold.end("node 'left' does not answer");

  EXPECT_TRUE(fold.is_news("node 'left' does not answer", kBegun + seconds(3)));
}

TEST(FailureFold, ForgetsTheOldestOfManyReasons) {
  FailureFold fold;
  for (int i = 0; i < 65; ++i) EXPECT_TRUE(fold.is_news(std::to_string(i), kBegun + std::chrono::milliseconds(i)));

  EXPECT_FALSE(fold.is_news("1", kBegun + seconds(1)));
  EXPECT_TRUE(fold.is_news("0", kBegun + seconds(1)));
}

}  // namespace failure_fold_test
}  // namespace mocap::runtime
