#include "trigger/answers.h"

#include <gmock/gmock.h>

namespace mocap::trigger {
namespace answers_test {

using testing::HasSubstr;

const AnsweredTake kTake{"walk", "/takes/today/walk.mcap"};

Request request_in(Dialect dialect, Verb verb) {
  Request request;
  request.dialect = dialect;
  request.verb = verb;
  request.packet_id = "17";
  return request;
}

TEST(TriggerAnswers, ACaptureStartHasTheTakeTheFolderAndThePacketId) {
  const std::string answer = *start_answer(request_in(Dialect::Capture, Verb::Start), kTake);

  EXPECT_THAT(answer, HasSubstr("CaptureStart"));
  EXPECT_THAT(answer, HasSubstr("walk"));
  EXPECT_THAT(answer, HasSubstr("/takes/today\""));
  EXPECT_THAT(answer, HasSubstr("17"));
}

TEST(TriggerAnswers, OscConfirmsAStopOnlyWhenTheFileIsComplete) {
  const Request stop = request_in(Dialect::Osc, Verb::Stop);

  EXPECT_FALSE(stop_answer(stop, "SUCCESS", kTake));
  EXPECT_THAT(*complete_answer(stop, "SUCCESS", kTake), HasSubstr("/RecordStopConfirm"));
  EXPECT_FALSE(complete_answer(request_in(Dialect::Osc, Verb::Start), "SUCCESS", kTake));
}

TEST(TriggerAnswers, OnlyCaptureHearsOfACompleteFileInXml) {
  EXPECT_THAT(*complete_answer(request_in(Dialect::Capture, Verb::Stop), "SUCCESS", kTake),
              HasSubstr("CaptureComplete"));
  EXPECT_FALSE(complete_answer(request_in(Dialect::Recording, Verb::Stop), "SUCCESS", kTake));
}

TEST(TriggerAnswers, ARefusalSaysWhyExceptInOsc) {
  EXPECT_THAT(*refusal_answer(request_in(Dialect::Capture, Verb::Start), "no disk"), HasSubstr("FAIL"));
  EXPECT_THAT(*refusal_answer(request_in(Dialect::Recording, Verb::Start), "no disk"), HasSubstr("no disk"));
  EXPECT_FALSE(refusal_answer(request_in(Dialect::Osc, Verb::Start), "no disk"));
}

}  // namespace answers_test
}  // namespace mocap::trigger
