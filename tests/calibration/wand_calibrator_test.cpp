#include "calibration/wand/wand_calibrator.h"

#include <gmock/gmock.h>

#include "calibration/rig/approximate_lens.h"
#include "calibration/rig/compare_rigs.h"
#include "calibration/wand/parse_wand.h"
#include "calibration/wand/wand_rig.h"
#include "lib/simworld/wand_world.h"

namespace mocap::calibration {
namespace wand_calibrator_test {

using testing::HasSubstr;

const Wand kWand{{0.0, 0.16, 0.5}};

CalibrationOrder wand_order() {
  CalibrationOrder order;
  order.action = CalibrationAction::Wand;
  order.wand_m = kWand.marks_m;
  return order;
}

CalibrationImage image_of(const Picture& picture, const CameraModel& camera) {
  CalibrationImage image;
  image.exposed_at = picture.exposed_at;
  image.width_px = camera.width_px;
  image.height_px = camera.height_px;
  for (const Spot& spot : picture.spots) static_cast<void>(image.spots.try_push_back({spot.at, spot.sigma_px}));
  return image;
}

void add_images(const Take& recording, const Rig& rig, RigCalibrator& calibrator) {
  for (std::size_t i = 0; i < recording.cameras[0].size(); ++i) {
    for (std::size_t c = 0; c < rig.size(); ++c) calibrator.add(c, image_of(recording.cameras[c][i], rig[c]));
  }
}

simworld::WandWorld waved(std::uint64_t seed) {
  return {{.cameras = 4, .noise_px = 0.1, .seconds = 20.0, .rate_hz = 30.0, .body = false}, kWand, seed};
}

TEST(WandCalibrator, FindsTheRigThatTheImagesWereMadeWith) {
  simworld::WandWorld world = waved(1);
  WandCalibrator calibrator({world.truth()}, 1);
  ASSERT_TRUE(calibrator.start(wand_order()));
  EXPECT_EQ(calibrator.report().state, CalibrationState::Collecting);

  add_images(world.take(), world.truth(), calibrator);
  const CalibrationReport collected = calibrator.report();
  calibrator.solve([](const char*, double) { return true; });
  const CalibrationReport solved = calibrator.report();

  EXPECT_EQ(collected.cameras[0].images, 600u);
  EXPECT_GT(collected.cameras[0].shared, 300u);
  EXPECT_THAT(collected.cameras[0].cells, testing::Contains(testing::Gt(0u)));
  ASSERT_EQ(solved.state, CalibrationState::Solved) << solved.message;
  EXPECT_FALSE(solved.result->floor_is_guessed) << "the cameras stand as in the rig before";
  EXPECT_LT(solved.result->rms_px, 0.105);
  const auto change = compare_rigs(world.truth(), solved.result->calibrated.rig, RigAlignment::AllCameras);
  ASSERT_TRUE(change);
  EXPECT_LT(change->position_m, 1e-3);
  EXPECT_TRUE(solved.result->calibrated.facts.contains("rms_px"));
}

TEST(WandCalibrator, BeginsWithoutAnyRigIfTheFieldOfViewIsKnown) {
  simworld::WandWorld world = waved(2);
  Rig unknown(world.truth().size());
  for (std::size_t c = 0; c < unknown.size(); ++c) {
    unknown[c].name = world.truth()[c].name;
    unknown[c].lens.fx_px = 0.0;
  }
  WandCalibrator calibrator({unknown}, 1);
  const Status refused = calibrator.start(wand_order());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("'" + unknown[0].name + "'"));
  CalibrationOrder order = wand_order();
  order.fov_deg = 65.0;
  ASSERT_TRUE(calibrator.start(order));
  EXPECT_THAT(calibrator.report().advice, HasSubstr("has not delivered an image"));

  add_images(world.take(), world.truth(), calibrator);
  calibrator.solve([](const char*, double) { return true; });

  const CalibrationReport solved = calibrator.report();
  ASSERT_EQ(solved.state, CalibrationState::Solved) << solved.message;
  EXPECT_TRUE(solved.result->floor_is_guessed);
  EXPECT_EQ(solved.result->calibrated.rig[0].width_px, world.truth()[0].width_px);

  WandCalibrator again({solved.result->calibrated.rig}, 1);
  EXPECT_TRUE(again.start(wand_order())) << "the estimated lenses are used";
  EXPECT_TRUE(again.start(order)) << "the estimated lenses are estimated again";
  EXPECT_THAT(again.report().advice, HasSubstr("has not delivered an image"));
}

TEST(WandCalibrator, AGuessedFloorStaysGuessed) {
  simworld::WandWorld world = waved(5);
  WandCalibrator calibrator({world.truth(), true}, 1);
  ASSERT_TRUE(calibrator.start(wand_order()));

  add_images(world.take(), world.truth(), calibrator);
  calibrator.solve([](const char*, double) { return true; });

  const CalibrationReport solved = calibrator.report();
  ASSERT_EQ(solved.state, CalibrationState::Solved) << solved.message;
  EXPECT_TRUE(solved.result->floor_is_guessed) << "the cameras stand as before, but no floor was ever measured";
  EXPECT_EQ(std::get<std::string>(solved.result->calibrated.facts.at("floor")), "guessed");
  EXPECT_THAT(solved.result->issues, testing::Contains(HasSubstr("the floor is not measured")));
}

TEST(WandCalibrator, EstimatesTheLensOfANewCameraAndKeepsTheOthers) {
  simworld::WandWorld world = waved(6);
  Rig known = world.truth();
  known[3].lens.fx_px = 0.0;
  known[3].camera_from_world = {};
  WandCalibrator calibrator({known}, 1);
  CalibrationOrder order = wand_order();
  order.fov_deg = 60.0;
  ASSERT_TRUE(calibrator.start(order));

  add_images(world.take(), world.truth(), calibrator);
  calibrator.solve([](const char*, double) { return true; });

  const CalibrationReport solved = calibrator.report();
  ASSERT_EQ(solved.state, CalibrationState::Solved) << solved.message;
  const Rig& rig = solved.result->calibrated.rig;
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(rig[c].lens.fx_px, known[c].lens.fx_px);
    EXPECT_EQ(rig[c].lens.distortion, known[c].lens.distortion);
    EXPECT_FALSE(rig[c].lens.is_from_fov);
  }
  EXPECT_TRUE(rig[3].lens.is_from_fov);
  EXPECT_NEAR(rig[3].lens.fx_px / world.truth()[3].lens.fx_px, 1.0, 3e-3);
  EXPECT_TRUE(solved.cameras[3].position_sigma_m) << "the covariance has only the lens that was estimated";
  EXPECT_THAT(solved.result->issues, testing::Contains(HasSubstr("calibrated lenses are kept")));
  EXPECT_FALSE(solved.result->floor_is_guessed) << "three cameras stand as before";
}

TEST(WandCalibrator, ReplacesCalibratedLensesIfTheyAreToBeEstimatedAgain) {
  simworld::WandWorld world = waved(7);
  WandCalibrator calibrator({world.truth()}, 1);
  CalibrationOrder order = wand_order();
  order.fov_deg = 60.0;
  order.refine_lens = true;
  ASSERT_TRUE(calibrator.start(order));

  add_images(world.take(), world.truth(), calibrator);
  calibrator.solve([](const char*, double) { return true; });

  const CalibrationReport solved = calibrator.report();
  ASSERT_EQ(solved.state, CalibrationState::Solved) << solved.message;
  for (const CameraModel& camera : solved.result->calibrated.rig) EXPECT_TRUE(camera.lens.is_from_fov) << camera.name;
  EXPECT_THAT(solved.result->issues, testing::Not(testing::Contains(HasSubstr("calibrated lenses are kept"))));
}

TEST(WandCalibrator, ReportsWhyThereIsNoRig) {
  simworld::WandWorld world = waved(3);
  WandCalibrator calibrator({world.truth()}, 1);
  ASSERT_TRUE(calibrator.start(wand_order()));
  calibrator.solve([](const char*, double) { return true; });
  EXPECT_EQ(calibrator.report().state, CalibrationState::Failed);
  EXPECT_THAT(calibrator.report().message, HasSubstr("has delivered images"));

  ASSERT_TRUE(calibrator.start(wand_order()));
  add_images(world.take(), world.truth(), calibrator);
  calibrator.solve([](const char*, double) { return false; });
  EXPECT_EQ(calibrator.report().state, CalibrationState::Cancelled);
  EXPECT_FALSE(calibrator.report().result);
}

TEST(WandCalibrator, RefusesWhatIsNoWand) {
  EXPECT_TRUE(wand_of({0.0, 0.5}));
  for (const std::vector<double>& marks : {std::vector<double>{}, {0.0}, {0.1, 0.5}, {0.0, 0.5, 0.5}, {0.0, 11.0}}) {
    EXPECT_FALSE(wand_of(marks));
  }
  EXPECT_TRUE(wand_of({0.0, 0.08}));
  EXPECT_THAT(wand_of({0.0, 0.05}).error().message, HasSubstr("wand is 50 mm long, expected 80 to 10000 mm"));
}

TEST(ParseWand, ReadsPresetsAndPositions) {
  EXPECT_EQ(parse_wand("500")->marks_m, (std::vector<double>{0.0, 0.16, 0.5}));
  EXPECT_EQ(parse_wand("0,160,500")->marks_m, (std::vector<double>{0.0, 0.16, 0.5}));
  EXPECT_FALSE(parse_wand("0,x"));
  EXPECT_THAT(parse_wand("0,16,50").error().message, HasSubstr("wand is 50 mm long"));
  EXPECT_THAT(parse_wand("0,16,50").error().message, HasSubstr("are these centimetres?"));
  EXPECT_THAT(parse_wand("0,10001").error().message, HasSubstr("wand is 10001 mm long, expected 80 to 10000 mm"));
}

TEST(WandRig, RefusesAnotherScaleThanThatOfTheRigBefore) {
  simworld::WandWorld world = waved(4);
  const auto solution = solve_wand(world.take(), world.truth(), kWand, {});
  ASSERT_TRUE(solution) << solution.error().message;
  Rig larger = world.truth();
  for (CameraModel& camera : larger) camera.camera_from_world.translation *= 1.1;

  EXPECT_FALSE(wrong_scale(*solution, world.truth()));
  EXPECT_THAT(wrong_scale(*solution, larger).value_or(""), HasSubstr("set its length with --wand"));
}

TEST(ApproximateLens, HasItsFieldOfView) {
  const Lens lens = lens_of({.fov_deg = 90.0}, 1280, 1024);

  EXPECT_NEAR(lens.fx_px, 640.0, 1e-9);
  EXPECT_EQ(lens.cy_px, 511.5);
  EXPECT_TRUE(lens.is_from_fov);
}

}  // namespace wand_calibrator_test
}  // namespace mocap::calibration
