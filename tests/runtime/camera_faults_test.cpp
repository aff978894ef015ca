#include "runtime/camera/camera_faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace mocap::runtime {
namespace camera_faults_test {

using std::chrono::seconds;
using testing::HasSubstr;
using testing::Not;

constexpr Timestamp kStart = from_ns(1'000'000'000);

/// The log lines that a report writes.
std::string lines_of(CameraFaults& faults, const CameraHealth& health, Timestamp at) {
  testing::internal::CaptureStderr();
  faults.report(health, at);
  return testing::internal::GetCapturedStderr();
}

TEST(CameraFaults, AreSilentForACameraWithoutFaults) {
  CameraFaults faults;
  CameraHealth health;
  health.name = "silent";
  health.frames = 1000;
  health.resent_packets = 7;  // they arrived: no fault

  EXPECT_EQ(lines_of(faults, health, kStart), "");
}

TEST(CameraFaults, NameCameraCountAndRemedyWhenAFaultBegins) {
  CameraFaults faults;
  CameraHealth health;
  health.name = "north";
  health.missing_packets = 3;

  const std::string line = lines_of(faults, health, kStart);

  EXPECT_THAT(line, HasSubstr("camera north: 3 packets never came"));
  EXPECT_THAT(line, HasSubstr("total=3; check cable and switch"));
}

TEST(CameraFaults, AreRepeatedOnceAMinuteWithTheIncrease) {
  CameraFaults faults;
  CameraHealth health;
  health.name = "east";
  health.missing_frames = 10;
  ASSERT_THAT(lines_of(faults, health, kStart), HasSubstr("10 images never came"));

  health.missing_frames = 14;
  EXPECT_EQ(lines_of(faults, health, kStart + seconds(59)), "");
  health.missing_frames = 15;
  EXPECT_THAT(lines_of(faults, health, kStart + seconds(60)), HasSubstr("5 images never came total=15"));
  EXPECT_EQ(lines_of(faults, health, kStart + seconds(300)), "") << "the count is unchanged";
}

TEST(CameraFaults, OfACameraThatWasReplacedCountFromZero) {
  CameraFaults faults;
  CameraHealth health;
  health.name = "west";
  health.missing_packets = 500;
  ASSERT_THAT(lines_of(faults, health, kStart), HasSubstr("500 packets never came"));

  health.missing_packets = 3;
  EXPECT_EQ(lines_of(faults, health, kStart + seconds(59)), "");
  health.missing_packets = 4;

  EXPECT_THAT(lines_of(faults, health, kStart + seconds(60)), HasSubstr("4 packets never came total=4"));
}

TEST(CameraFaults, OfDifferentKindsDoNotDelayEachOther) {
  CameraFaults faults;
  CameraHealth health;
  health.name = "south";
  health.missing_frames = 1;
  ASSERT_THAT(lines_of(faults, health, kStart), HasSubstr("images never came"));

  health.failed_frames = 1;
  health.underruns = 2;
  health.dropped_queue_full = 3;
  health.repeated_frames = 4;
  health.clock_leaps = 5;
  const std::string lines = lines_of(faults, health, kStart + seconds(1));

  EXPECT_THAT(lines, Not(HasSubstr("images never came")));
  EXPECT_THAT(lines, HasSubstr("1 images came incomplete or were refused"));
  EXPECT_THAT(lines, HasSubstr("'unusable image' of this camera has the reason"));
  EXPECT_THAT(lines, HasSubstr("2 images arrived while no buffer was free"));
  EXPECT_THAT(lines, HasSubstr("3 images dropped, the queue to the fusion was full"));
  EXPECT_THAT(lines, HasSubstr("4 images came a second time"));
  EXPECT_THAT(lines, HasSubstr("5 times its clock jumped"));
}

}  // namespace camera_faults_test
}  // namespace mocap::runtime
