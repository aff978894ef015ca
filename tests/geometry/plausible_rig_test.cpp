#include "geometry/plausible_rig.h"

#include <gmock/gmock.h>

#include <numbers>

#include "scene/ring_rig.h"

namespace mocap::geometry {
namespace plausible_rig_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Rig four_cameras() {
  return scene::ring_rig(
      {.cameras = 4, .radius_m = 4.0, .height_m = 2.5, .width_px = 1280, .height_px = 1024, .hfov_rad = 1.1});
}

TEST(PlausibleRig, HasNoFault) { EXPECT_THAT(implausible_values(four_cameras()), IsEmpty()); }

TEST(PlausibleRig, MayHaveLensesOnly) {
  Rig rig = four_cameras();
  for (CameraModel& camera : rig) camera.camera_from_world = {};

  EXPECT_THAT(implausible_values(rig), IsEmpty());
}

TEST(PlausibleRig, IsInMetres) {
  Rig rig = four_cameras();
  for (CameraModel& camera : rig) camera.camera_from_world.translation *= 1000.0;

  const auto values = implausible_values(rig);

  ASSERT_THAT(values, SizeIs(4));
  EXPECT_EQ(values[0].part, RigPart::Translation);
  EXPECT_THAT(values[0].message, HasSubstr("expected at most 100 m; translation looks like millimetres"));
}

TEST(PlausibleRig, NamesTheOneCameraInMillimetres) {
  Rig rig = four_cameras();
  rig[2].camera_from_world.translation *= 1000.0;

  const auto values = implausible_values(rig);

  ASSERT_THAT(values, SizeIs(1));
  EXPECT_EQ(values[0].camera, 2U);
}

TEST(PlausibleRig, HasOneCameraAtAPlace) {
  Rig rig = four_cameras();
  rig[3].camera_from_world = rig[1].camera_from_world;

  const auto values = implausible_values(rig);

  ASSERT_THAT(values, SizeIs(1));
  EXPECT_EQ(values[0].camera, 3U);
  EXPECT_THAT(values[0].message, HasSubstr("from '" + rig[1].name + "', expected at least 5 mm"));
}

TEST(PlausibleRig, HasFocalLengthsInPixels) {
  Rig rig = four_cameras();
  rig[0].lens.fx_px = rig[0].lens.fy_px = 8.0;    // mm
  rig[1].lens.fx_px = rig[1].lens.fy_px = 2.0e4;  // 3.7 degrees

  const auto values = implausible_values(rig);

  ASSERT_THAT(values, SizeIs(2));
  EXPECT_THAT(values[0].message, HasSubstr("focal length of 8 px gives an opening angle of 178.6 degrees"));
  EXPECT_THAT(values[0].message, HasSubstr("looks like millimetres"));
  EXPECT_THAT(values[1].message, HasSubstr("3.7 degrees, expected 5 to 170"));
}

TEST(PlausibleRig, MayHaveAFisheyeOf180Degrees) {
  Rig rig = four_cameras();
  rig[0].lens.kind = LensKind::Fisheye;
  rig[0].lens.fx_px = rig[0].lens.fy_px = 1280.0 / std::numbers::pi;

  EXPECT_THAT(implausible_values(rig), IsEmpty());
}

TEST(PlausibleRig, HasPrincipalPointsNearTheImage) {
  Rig rig = four_cameras();
  rig[1].lens.cx_px = 1950.0;

  const auto values = implausible_values(rig);

  ASSERT_THAT(values, SizeIs(1));
  EXPECT_THAT(values[0].message, HasSubstr("principal point is [1950"));
  EXPECT_THAT(values[0].message, HasSubstr("expected x -640 to 1920"));
}

TEST(RotationVector, IsInRadiansAndAtMostPi) {
  const double pi = std::numbers::pi;

  EXPECT_EQ(rotation_vector_fault({0.0, 0.0, pi}), std::nullopt);
  EXPECT_THAT(rotation_vector_fault({90.0, 0.0, 0.0}).value_or(""), HasSubstr("looks like degrees"));
  EXPECT_THAT(rotation_vector_fault({1.5 * pi, 0.0, 0.0}).value_or(""),
              HasSubstr("the same rotation is [-1.57079633, 0, 0]"));
}

}  // namespace plausible_rig_test
}  // namespace mocap::geometry
