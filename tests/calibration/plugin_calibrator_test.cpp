#include "calibration/plugin_calibrator.h"

#include <gmock/gmock.h>

#include "lib/simworld/wand_world.h"

namespace mocap::calibration {
namespace plugin_calibrator_test {

TEST(PluginCalibrator, IsIdleBeforeTheFirstCollection) {
  PluginCalibrator calibrator({}, 1);

  EXPECT_EQ(calibrator.report().state, CalibrationState::Idle);
  EXPECT_FALSE(calibrator.add(0, {}));
}

TEST(PluginCalibrator, CollectsWithThePlugIn) {
  const Wand wand{{0.0, 0.5}};
  simworld::WandWorld world({.cameras = 3, .noise_px = 0.1, .seconds = 1.0, .rate_hz = 10.0, .body = false}, wand, 1);
  PluginCalibrator calibrator({world.truth()}, 1);
  CalibrationOrder order;
  order.wand_m = wand.marks_m;

  const Status started = calibrator.start(order);

  ASSERT_TRUE(started) << started.error().message;
  EXPECT_EQ(calibrator.report().state, CalibrationState::Collecting);
  order.wand_m = {0.0};
  EXPECT_EQ(calibrator.start(order).error().code, ErrorCode::InvalidArgument);
}

}  // namespace plugin_calibrator_test
}  // namespace mocap::calibration
