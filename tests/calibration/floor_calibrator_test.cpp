#include "calibration/floor/floor_calibrator.h"

#include <gmock/gmock.h>

#include <functional>
#include <random>
#include <vector>

#include "calibration/floor/floor.h"
#include "calibration/order_calibrator.h"
#include "scene/ring_rig.h"

namespace mocap::calibration {
namespace floor_calibrator_test {

using Eigen::Vector3d;

// The provisional world frame after a wand calibration, from the true one.
const Pose kProvisional{{0.3, -0.2, 0.4},
                        Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Vector3d(1.0, 0.5, 0.0).normalized()))};
constexpr Duration kPeriod = std::chrono::milliseconds(10);

Rig provisional_rig() { return in_world({kProvisional, 0.0}, scene::ring_rig({.cameras = 4})); }

CalibrationOrder floor_order(FloorMethod method) {
  CalibrationOrder order;
  order.action = CalibrationAction::Floor;
  order.floor.method = method;
  return order;
}

using Places = std::function<std::vector<Vector3d>(int instant)>;

// Adds instants with markers at these places of the true world until no more are welcome; returns their number.
int add_until_enough(RigCalibrator& calibrator, const Places& places_m) {
  for (int i = 0; i < 10000; ++i) {
    CalibrationMarkers markers;
    markers.exposed_at = Timestamp{i * kPeriod};
    std::uint32_t track = 0;
    for (const Vector3d& at : places_m(i)) {
      static_cast<void>(markers.markers.try_push_back({TrackId{track++}, WorldPoint{kProvisional * at}, 4}));
    }
    if (!calibrator.add(markers)) return i + 1;
  }
  return 10000;
}

const std::vector<Vector3d> kFrame = {{0.0, 0.4, 0.0}, {0.0, 0.0, 0.0}, {0.6, 0.0, 0.0}, {1.5, 0.9, 0.0}};

TEST(FloorCalibrator, PutsTheRigIntoTheWorldOfTheFloorFrame) {
  FloorCalibrator calibrator(provisional_rig());
  ASSERT_TRUE(calibrator.start(floor_order(FloorMethod::Frame)));

  EXPECT_EQ(add_until_enough(calibrator, [](int) { return kFrame; }), 501) << "five seconds of exposures";
  calibrator.solve({});

  const CalibrationReport report = calibrator.report();
  ASSERT_TRUE(report.result) << report.message;
  EXPECT_EQ(report.state, CalibrationState::Solved);
  EXPECT_TRUE(report.is_floor);
  EXPECT_LT(*report.result->floor_rms_m, 1e-9);
  const Rig truth = scene::ring_rig({.cameras = 4});
  for (std::size_t c = 0; c < truth.size(); ++c) {
    EXPECT_LT((report.result->calibrated.rig[c].centre().v - truth[c].centre().v).norm(), 1e-9);
  }
  EXPECT_EQ(std::get<std::string>(report.result->calibrated.facts.at("floor")), "frame");
}

TEST(FloorCalibrator, ReportsNoResidualOfThreeMarkers) {
  FloorCalibrator calibrator(provisional_rig());
  ASSERT_TRUE(calibrator.start(floor_order(FloorMethod::Points)));

  add_until_enough(calibrator, [](int) { return std::vector<Vector3d>(kFrame.begin(), kFrame.begin() + 3); });
  calibrator.solve({});

  const CalibrationReport report = calibrator.report();
  ASSERT_TRUE(report.result) << report.message;
  EXPECT_TRUE(report.is_floor);
  EXPECT_FALSE(report.result->floor_rms_m);
  EXPECT_FALSE(report.result->calibrated.facts.contains("floor_rms_mm"));
  ASSERT_EQ(report.result->issues.size(), 1U);
  EXPECT_THAT(report.result->issues[0], testing::HasSubstr("lay a fourth one"));
}

TEST(FloorCalibrator, RefusesMarkersThatMove) {
  FloorCalibrator calibrator(provisional_rig());
  ASSERT_TRUE(calibrator.start(floor_order(FloorMethod::Frame)));

  add_until_enough(calibrator, [](int instant) {
    std::vector<Vector3d> moved = kFrame;
    for (Vector3d& at : moved) at.x() += 0.001 * instant;
    return moved;
  });
  calibrator.solve({});

  EXPECT_EQ(calibrator.report().state, CalibrationState::Failed);
  EXPECT_FALSE(calibrator.report().message.empty());
  EXPECT_FALSE(calibrator.report().result);
}

TEST(FloorCalibrator, FitsTheFloorToAWalkThatIsLongerThanItKeeps) {
  FloorCalibrator calibrator(provisional_rig());
  ASSERT_TRUE(calibrator.start(floor_order(FloorMethod::Walk)));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-1.5, 1.5), height(0.0, 1.7);

  const int instants = add_until_enough(calibrator, [&](int /*instant*/) {
    std::vector<Vector3d> places;
    for (int m = 0; m < 20; ++m) places.emplace_back(place(random), place(random), m % 5 == 0 ? 0.0 : height(random));
    return places;
  });
  EXPECT_EQ(instants, 3001) << "thirty seconds, 60,000 positions";
  calibrator.solve({});

  const CalibrationReport report = calibrator.report();
  ASSERT_TRUE(report.result) << report.message;
  const Rig truth = scene::ring_rig({.cameras = 4});
  for (std::size_t c = 0; c < truth.size(); ++c) {
    EXPECT_NEAR(report.result->calibrated.rig[c].centre().v.z(), truth[c].centre().v.z(), 0.01);
  }
}

TEST(FloorCalibrator, NeedsARig) {
  Rig rig = provisional_rig();
  rig[2].lens.fx_px = 0.0;
  FloorCalibrator calibrator(rig);

  const Status started = calibrator.start(floor_order(FloorMethod::Frame));

  ASSERT_FALSE(started);
  EXPECT_THAT(started.error().message, testing::HasSubstr("'" + rig[2].name + "' is not in the rig"));
  EXPECT_FALSE(calibrator.add(CalibrationMarkers{}));
}

TEST(OrderCalibrator, GivesMarkersToTheFloorOnly) {
  OrderCalibrator calibrator(std::make_unique<FloorCalibrator>(Rig{}),
                             std::make_unique<FloorCalibrator>(provisional_rig()));
  EXPECT_FALSE(calibrator.add(CalibrationMarkers{})) << "nothing was ordered";
  EXPECT_EQ(calibrator.report().state, CalibrationState::Idle);

  ASSERT_TRUE(calibrator.start(floor_order(FloorMethod::Points)));
  EXPECT_TRUE(calibrator.add(CalibrationMarkers{}));
  CalibrationOrder wand;
  wand.action = CalibrationAction::Wand;
  ASSERT_TRUE(calibrator.start(wand)) << "a rig without cameras lacks none";
  EXPECT_FALSE(calibrator.report().cameras.size());
}

}  // namespace floor_calibrator_test
}  // namespace mocap::calibration
