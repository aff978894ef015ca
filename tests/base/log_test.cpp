#include "base/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace mocap {
namespace log_test {

using testing::HasSubstr;
using testing::internal::CaptureStderr;
using testing::internal::GetCapturedStderr;

// Each test writes lines that no other test writes: repeats within one second are folded.
class Log : public testing::Test {
 protected:
  ~Log() override {
    set_log_level(LogLevel::Info);
    set_log_for_journal(false);
  }
};

TEST_F(Log, WritesOneLineWithLevelPartAndEvent) {
  CaptureStderr();

  log_error("camera north", "no image for 500ms");

  EXPECT_THAT(GetCapturedStderr(), testing::ContainsRegex("^[0-9:.]+ error camera north: no image for 500ms\n$"));
}

TEST_F(Log, OmitsDebugLinesUntilTheLevelIsLowered) {
  CaptureStderr();

  log_debug("detect", "first");
  set_log_level(LogLevel::Debug);
  log_debug("detect", "second");
  log_warn("detect", "end");  // warnings are flushed

  EXPECT_THAT(GetCapturedStderr(), AllOf(Not(HasSubstr("first")), HasSubstr("debug detect: second")));
}

TEST_F(Log, OmitsWarningsIfOnlyErrorsAreWanted) {
  set_log_level(LogLevel::Error);
  CaptureStderr();

  log_warn("fusion", "degraded");
  log_error("fusion", "ended");

  EXPECT_THAT(GetCapturedStderr(), AllOf(Not(HasSubstr("degraded")), HasSubstr("ended")));
}

TEST_F(Log, HasPrioritiesOfSystemdAndNoTimeForTheJournal) {
  set_log_level(LogLevel::Debug);
  set_log_for_journal(true);
  CaptureStderr();

  log_debug("a", "journal");
  log_info("b", "journal");
  log_warn("c", "journal");
  log_error("d", "journal");

  // Source of the digits: sd-daemon(3).
  EXPECT_EQ(GetCapturedStderr(), "<7>a: journal\n<6>b: journal\n<4>c: journal\n<3>d: journal\n");
}

TEST_F(Log, FoldsRepeatsIntoTheirNumber) {
  CaptureStderr();

  for (int i = 0; i < 5; ++i) log_warn("publish", "peer is slow");
  log_warn("publish", "peer is gone");

  const std::string text = GetCapturedStderr();
  EXPECT_EQ(text.find("peer is slow"), text.rfind("peer is slow")) << text;
  EXPECT_THAT(text, HasSubstr("4 duplicate messages"));
}

TEST_F(Log, AcceptsBracesInAMessage) {
  CaptureStderr();

  log_warn("control", "request {} is {invalid");

  EXPECT_THAT(GetCapturedStderr(), HasSubstr("control: request {} is {invalid"));
}

}  // namespace log_test
}  // namespace mocap
