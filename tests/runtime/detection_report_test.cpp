#include "runtime/camera/detection_report.h"

#include <gtest/gtest.h>

namespace mocap::runtime {
namespace detection_report_test {

using std::chrono::seconds;

/// A camera at 60 Hz whose report is updated once a second.
class Camera {
 public:
  explicit Camera(bool automatic = true) : report_(automatic) {}

  /// Advances by one second in which `more` is added to the counts; returns the log lines.
  std::vector<std::string> second(const DetectionCounts& more, double threshold_grey = 38.0) {
    seen_.images += 60;
    seen_.counts.blobs += more.blobs;
    seen_.counts.too_small += more.too_small;
    seen_.counts.not_round += more.not_round;
    seen_.counts.dropped += more.dropped;
    seen_.counts.rows_given_up += more.rows_given_up;
    seen_.levels = {threshold_grey, 2.1, 12.0};
    now_ += seconds(1);
    std::vector<std::string> lines;
    for (const auto& line : report_.look(seen_, now_)) {
      lines.push_back((line.level == LogLevel::Warn ? "warn " : "info ") + line.what);
    }
    return lines;
  }

 private:
  DetectionReport report_;
  DetectionSeen seen_;
  Timestamp now_ = from_ns(1'000'000'000);
};

using Lines = std::vector<std::string>;

DetectionCounts blobs(std::uint64_t count) {
  DetectionCounts counts;
  counts.blobs = count;
  return counts;
}

TEST(DetectionReport, LogsTheThresholdOnce) {
  Camera camera;

  EXPECT_EQ(camera.second(blobs(100)), Lines{"info threshold 38 grey (noise 2.1, background 12), automatic"});
  EXPECT_EQ(camera.second(blobs(100)), Lines{});
  EXPECT_EQ(Camera(false).second(blobs(100)), Lines{"info threshold 38 grey (noise 2.1, background 12), as set"});
}

TEST(DetectionReport, LogsALargeThresholdChangeAtMostEveryTenSeconds) {
  Camera camera;
  camera.second(blobs(100));
  for (int i = 0; i < 9; ++i) EXPECT_EQ(camera.second(blobs(100), 60.0), Lines{});

  EXPECT_EQ(camera.second(blobs(100), 60.0),
            Lines{"info threshold 60 grey (noise 2.1, background 12), automatic, was 38"});
  for (int i = 0; i < 20; ++i) EXPECT_EQ(camera.second(blobs(100), 65.0), Lines{}) << "a little is no news";
}

TEST(DetectionReport, LogsWhyACameraSeesNothingAfterThreeSecondsThenOnceAMinute) {
  Camera camera;
  camera.second(blobs(100));
  DetectionCounts lost;
  lost.too_small = 212;
  lost.not_round = 3;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(camera.second(lost), Lines{});

  EXPECT_EQ(camera.second(lost),
            Lines{"warn 0 blobs in 60 images: 212 too small, 3 not round (threshold 38 grey); see [detect]"});
  for (int i = 0; i < 59; ++i) EXPECT_EQ(camera.second(lost), Lines{});
  EXPECT_EQ(camera.second(lost).size(), 1U);
}

TEST(DetectionReport, DoesNotWarnOfAnEmptyVolume) {
  Camera camera;
  camera.second({});
  camera.second({});
  camera.second({});

  EXPECT_EQ(camera.second({}), Lines{"info 0 blobs in 60 images: nothing is bright enough (threshold 38 grey)"});
}

TEST(DetectionReport, DoesNotWarnOfAShortOcclusion) {
  Camera camera;
  camera.second(blobs(100));
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(camera.second({}), Lines{});
    EXPECT_EQ(camera.second({}), Lines{});
    EXPECT_EQ(camera.second(blobs(1)), Lines{});
  }
}

TEST(DetectionReport, WarnsIfABoundIsReachedDespiteBlobs) {
  Camera camera;
  camera.second(blobs(100));
  DetectionCounts over = blobs(512);
  over.dropped = 7;
  over.rows_given_up = 40;

  EXPECT_EQ(camera.second(over),
            Lines{"warn 512 blobs in 60 images, and left out: 7 over the bound of an image, 40 rows "
                  "of noise; mask what shines, or raise its threshold"});
  EXPECT_EQ(camera.second(over), Lines{});
}

TEST(DetectionReport, LogsNothingForACameraWithoutImages) {
  DetectionReport report(true);

  for (int i = 0; i < 100; ++i) EXPECT_TRUE(report.look({}, from_ns(i * 1'000'000'000LL)).empty());
}

}  // namespace detection_report_test
}  // namespace mocap::runtime
