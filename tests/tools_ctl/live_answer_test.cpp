#include "ctl/live/live_answer.h"

#include <gmock/gmock.h>

#include <cstdio>
#include <string>

namespace mocap::ctl {
namespace live_answer_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string text_of(const v1::Answer& answer) {
  ::testing::internal::CaptureStdout();
  print_answer(answer, false, false);
  std::fflush(stdout);
  return ::testing::internal::GetCapturedStdout();
}

TEST(LiveAnswer, PrintsTheResidualOfACheckedFloorOnly) {
  v1::Answer answer;
  v1::Calibration& calibration = *answer.mutable_calibration();
  calibration.set_state(v1::CALIBRATION_STATE_SOLVED);
  calibration.set_floor(true);
  calibration.mutable_result()->add_issues("the floor is not checked");

  const std::string unchecked = text_of(answer);
  calibration.mutable_result()->clear_issues();
  calibration.mutable_result()->set_floor_rms_m(0.0004);
  const std::string checked = text_of(answer);

  EXPECT_THAT(unchecked, AllOf(HasSubstr("floor   residual -\n"), HasSubstr("the floor is not checked")));
  EXPECT_THAT(unchecked, Not(HasSubstr("grade"))) << "no result of a calibration of the cameras";
  EXPECT_THAT(checked, HasSubstr("floor   residual 0.4 mm"));
}

}  // namespace live_answer_test
}  // namespace mocap::ctl
