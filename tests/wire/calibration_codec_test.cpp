#include "wire/codec/calibration_codec.h"

#include <gmock/gmock.h>

#include <limits>

#include "wire/codec/control_codec.h"

namespace mocap::wire {
namespace calibration_codec_test {

v1::Request request_of(v1::CalibrationRequest::Action action) {
  v1::Request request;
  request.mutable_calibration()->set_action(action);
  return request;
}

TEST(CalibrationCodec, OnlyStatusAndListAreForViewers) {
  EXPECT_TRUE(only_looks(decode(request_of(v1::CalibrationRequest::ACTION_STATUS))->action));
  EXPECT_TRUE(only_looks(decode(request_of(v1::CalibrationRequest::ACTION_LIST))->action));
  for (const auto action : {v1::CalibrationRequest::ACTION_SOLVE, v1::CalibrationRequest::ACTION_APPLY,
                            v1::CalibrationRequest::ACTION_CANCEL, v1::CalibrationRequest::ACTION_WAND}) {
    EXPECT_FALSE(only_looks(decode(request_of(action))->action)) << action;
  }
}

TEST(CalibrationCodec, AnOrderSurvivesTheWire) {
  ControlRequest sent;
  sent.action = ControlAction::Calibrate;
  sent.calibration.action = CalibrationAction::Wand;
  sent.calibration.wand_m = {0.0, 0.16, 0.5};
  sent.calibration.fov_deg = 65.0;
  sent.calibration.moved = true;

  const auto came = decode(encode(sent));

  ASSERT_TRUE(came) << came.error().message;
  EXPECT_EQ(came->calibration.wand_m, sent.calibration.wand_m);
  EXPECT_EQ(came->calibration.fov_deg, 65.0);
  EXPECT_TRUE(came->calibration.moved);
}

TEST(CalibrationCodec, AnOrderOfTheFloorSurvivesTheWire) {
  ControlRequest sent;
  sent.action = ControlAction::Calibrate;
  sent.calibration.action = CalibrationAction::Floor;
  sent.calibration.floor = {FloorMethod::Walk, 0.5, 0.3, 0.04};

  const auto came = decode(encode(sent));

  ASSERT_TRUE(came) << came.error().message;
  EXPECT_EQ(came->calibration.floor.method, FloorMethod::Walk);
  EXPECT_EQ(came->calibration.floor.long_m, 0.5);
  EXPECT_EQ(came->calibration.floor.short_m, 0.3);
  EXPECT_EQ(came->calibration.floor.height_m, 0.04);
  const auto by_default = decode(request_of(v1::CalibrationRequest::ACTION_FLOOR));
  EXPECT_EQ(by_default->calibration.floor.method, FloorMethod::Frame);
  EXPECT_EQ(by_default->calibration.floor.long_m, 0.6);
}

TEST(CalibrationCodec, NamesTheFieldThatIsWrong) {
  v1::Request floor = request_of(v1::CalibrationRequest::ACTION_FLOOR);
  floor.mutable_calibration()->mutable_floor()->set_height_m(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(decode(floor).error().message, ::testing::HasSubstr("height_m"));
  floor.mutable_calibration()->mutable_floor()->set_short_m(11.0);
  EXPECT_THAT(decode(floor).error().message, ::testing::HasSubstr("short_m is 11"));
  v1::Request wand = request_of(v1::CalibrationRequest::ACTION_WAND);
  wand.mutable_calibration()->set_fov_deg(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(decode(wand).error().message, ::testing::HasSubstr("fov_deg"));
  wand.mutable_calibration()->add_wand_m(-1.0);
  EXPECT_THAT(decode(wand).error().message, ::testing::HasSubstr("wand_m"));
  EXPECT_THAT(decode(request_of(v1::CalibrationRequest::ACTION_RESTORE)).error().message, ::testing::HasSubstr("name"));
  EXPECT_THAT(decode(request_of(v1::CalibrationRequest::ACTION_UNSPECIFIED)).error().message,
              ::testing::HasSubstr("action is missing"));
}

TEST(CalibrationCodec, AReportIsEncodedWithItsResult) {
  CalibrationReport report;
  report.state = CalibrationState::Solved;
  report.cameras.resize(1);
  report.cameras[0].cells[63] = 5;
  report.result.emplace();
  report.result->grade = "good";

  const v1::Calibration encoded = encode(report);

  EXPECT_EQ(encoded.state(), v1::CALIBRATION_STATE_SOLVED);
  EXPECT_EQ(encoded.cameras(0).cells(63), 5u);
  EXPECT_EQ(encoded.result().grade(), "good");
  EXPECT_EQ(encode(std::vector<KeptRig>{{"a", "", "", 4, 0.1, true}}).rigs(0).cameras(), 4u);
}

}  // namespace calibration_codec_test
}  // namespace mocap::wire
