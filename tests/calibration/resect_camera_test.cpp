#include "calibration/rig/resect_camera.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "geometry/lens.h"
#include "scene/random.h"
#include "scene/ring_rig.h"
#include "support/places.h"

namespace mocap::calibration {
namespace resect_camera_test {

CameraModel some_camera() {
  CameraModel camera;
  camera.name = "one";
  camera.width_px = 1280;
  camera.height_px = 1024;
  camera.lens = {LensKind::Pinhole, 1150.0, 1148.0, 650.0, 500.0};
  camera.lens.distortion << -0.12, 0.06, 0.0004, -0.0006, 0.0;
  camera.camera_from_world = scene::look_at({3.0, 1.0, 2.2}, {0.0, 0.0, 1.0});
  return camera;
}

std::vector<PointObservation> sights_of(const CameraModel& camera, int count, double noise_px, std::uint64_t seed) {
  scene::Random random(seed);
  std::vector<PointObservation> observations;
  while (static_cast<int>(observations.size()) < count) {
    const Eigen::Vector3d at(2.0 * random.uniform() - 1.0, 2.0 * random.uniform() - 1.0, 2.0 * random.uniform());
    const auto seen = geometry::project(camera, {at});
    if (!seen || !geometry::in_image(camera, *seen)) continue;
    observations.push_back({{at}, {seen->v + noise_px * Eigen::Vector2d(random.normal(), random.normal())}, noise_px});
  }
  return observations;
}

TEST(ResectCamera, EstimatesPoseAndLensFromPoints) {
  const CameraModel truth = some_camera();
  CameraModel sizes;
  sizes.width_px = truth.width_px;
  sizes.height_px = truth.height_px;

  const auto fitted = resect_camera(sizes, sights_of(truth, 300, 0.1, 1));

  ASSERT_TRUE(fitted);
  EXPECT_NEAR(fitted->rms_px, 0.1, 0.01);
  EXPECT_LT((fitted->camera.centre().v - truth.centre().v).norm(), 0.01);  // m; focal length and depth are correlated
  EXPECT_NEAR(fitted->camera.lens.fx_px, truth.lens.fx_px, 3.0);
}

TEST(ResectCamera, EstimatesThePoseOfABumpedCameraAndItsUncertainty) {
  const CameraModel truth = some_camera();
  CameraModel start = truth;
  start.camera_from_world.rotation =
      Eigen::AngleAxisd(0.01, Eigen::Vector3d(1.0, -1.0, 0.5).normalized()) * start.camera_from_world.rotation;
  start.camera_from_world.translation += Eigen::Vector3d(0.01, -0.02, 0.01);
  double squares = 0.0;
  double predicted = 0.0;
  for (std::uint64_t seed = 2; seed < 14; ++seed) {
    auto observations = sights_of(truth, 200, 0.1, seed);
    for (std::size_t i = 0; i < 10; ++i) observations[20 * i].at.v.x() += 40.0;  // blobs of another marker

    const auto fitted = resect_pose(start, observations);

    ASSERT_TRUE(fitted);
    EXPECT_EQ(fitted->used, 190U);
    squares += (fitted->camera.centre().v - truth.centre().v).squaredNorm();
    ASSERT_TRUE(fitted->uncertainty);
    predicted += fitted->uncertainty->position_m * fitted->uncertainty->position_m;
  }
  EXPECT_LT(std::sqrt(squares / 12.0), 5e-4);
  // 36 degrees of freedom: the ratio has a standard deviation of 12 %.
  EXPECT_NEAR(std::sqrt(predicted / squares), 1.0, 0.35);
}

// The bounds of repair_rig are 5 mm and 0.1 degrees.
TEST(ResectCamera, AHundredViewsOfAVolumeDetermineThePoseToAMillimetre) {
  const CameraModel truth = some_camera();
  for (std::uint64_t seed = 20; seed < 30; ++seed) {
    const auto fitted = resect_pose(truth, sights_of(truth, 100, 0.1, seed));

    ASSERT_TRUE(fitted && fitted->uncertainty);
    EXPECT_LT(fitted->uncertainty->position_m, 0.001);
    EXPECT_LT(fitted->uncertainty->rotation_rad, 0.02 * std::numbers::pi / 180.0);
    RecordProperty("sigma_mm_" + std::to_string(seed), std::to_string(1e3 * fitted->uncertainty->position_m));
    RecordProperty("sigma_mdeg_" + std::to_string(seed),
                   std::to_string(1e3 * fitted->uncertainty->rotation_rad * 180.0 / std::numbers::pi));
  }
}

TEST(ResectCamera, ReportsThatOnePointDoesNotDetermineThePose) {
  const CameraModel truth = some_camera();
  const std::vector<PointObservation> observations(100, sights_of(truth, 1, 0.1, 4).front());

  const auto fitted = resect_pose(truth, observations);

  if (fitted && fitted->uncertainty) {
    EXPECT_GT(fitted->uncertainty->position_m, 0.1);
  }
}

TEST(ResectCamera, RefusesCoplanarPoints) {
  auto observations = sights_of(some_camera(), 100, 0.1, 3);
  for (PointObservation& observation : observations) {
    observation.point.v.z() = 0.0;
    observation.at = geometry::project(some_camera(), observation.point).value_or(observation.at);
  }

  EXPECT_FALSE(resect_camera(some_camera(), observations));
}

// The file has image x, y and world x, y, z in mm of points of a real calibration target.
TEST(ResectCamera, FitsTheCamerasOfARealRigToHalfAPixel) {
  const std::filesystem::path folder = support::shared_data_folder() + "/multiview/particles";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no " << folder;
  for (const char* name : {"cam1", "cam2", "cam3"}) {
    std::ifstream file(folder / (std::string(name) + "_cal_points.txt"));
    std::vector<PointObservation> observations;
    for (double u, v, x, y, z; file >> u >> v >> x >> y >> z;)
      observations.push_back({{1e-3 * Eigen::Vector3d(x, y, z)}, {{u, v}}, 0.3});
    ASSERT_GT(observations.size(), 50U) << name;
    CameraModel sizes;
    sizes.name = name;
    sizes.width_px = 1280;
    sizes.height_px = 1024;

    const auto fitted = resect_camera(sizes, observations);

    ASSERT_TRUE(fitted) << name;
    // The rms residual of all points including outliers, both axes together.
    double squares = 0.0;
    for (const PointObservation& observation : observations) {
      const auto at = geometry::project(fitted->camera, observation.point);
      ASSERT_TRUE(at);
      squares += (at->v - observation.at.v).squaredNorm();
    }
    EXPECT_LT(std::sqrt(squares / static_cast<double>(observations.size())), 0.55) << name;
    RecordProperty(std::string(name) + "_rms_px",
                   std::to_string(std::sqrt(squares / static_cast<double>(observations.size()))));
  }
}

}  // namespace resect_camera_test
}  // namespace mocap::calibration
