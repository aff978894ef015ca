#include "calibration/rig/assess_rig.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "calibration/sighting_of.h"
#include "geometry/lens.h"
#include "geometry/rigid_fit.h"
#include "geometry/triangulation.h"
#include "lib/simworld/wand_world.h"

namespace mocap::calibration {
namespace assess_rig_test {

using testing::Contains;
using testing::Field;
using testing::HasSubstr;

const Wand kWand{{0.0, 0.16, 0.5}};
constexpr double kNoise_px = 0.2;

struct World {
  Rig truth;
  WandSolution solution;
};

World solve(std::uint64_t seed) {
  simworld::WandWorld world({.cameras = 5, .noise_px = kNoise_px, .seconds = 12.0, .rate_hz = 25.0}, kWand, seed);
  auto solution = solve_wand(world.take(), world.truth(), kWand, {});
  EXPECT_TRUE(solution) << solution.error().message;
  return {world.truth(), *std::move(solution)};
}

bool has_issue(const RigAssessment& assessment, Grade at_least, const std::string& part) {
  for (const RigIssue& issue : assessment.issues) {
    if (issue.grade >= at_least && issue.text.find(part) != std::string::npos) return true;
  }
  return false;
}

TEST(AssessRig, PredictsTheErrorOfTriangulatedPoints) {
  // The mean squared error equals the mean predicted variance. All points of one rig share the error of the rig, so
  // several rigs are needed; with 6 the ratio of the roots has a standard deviation of about 10 %.
  double errors = 0.0;
  double predicted = 0.0;
  for (std::uint64_t seed = 21; seed <= 26; ++seed) {
    const World world = solve(seed);
    const RigEvidence evidence = evidence_of(world.solution, std::nullopt);
    std::vector<geometry::PointPair> centres;
    for (std::size_t c = 0; c < evidence.rig.size(); ++c) {
      centres.push_back({evidence.rig[c].centre().v, world.truth[c].centre().v});
    }
    const Pose truth_from_rig = geometry::fit_rigid(centres)->to_from;
    std::mt19937 random(static_cast<std::uint32_t>(seed));
    std::normal_distribution<double> noise(0.0, kNoise_px);
    for (std::size_t i = 0; i < evidence.points_m.size(); i += 5) {
      const Eigen::Vector3d point = evidence.points_m[i];
      std::vector<geometry::Sighting> rays;
      for (std::size_t c = 0; c < evidence.rig.size(); ++c) {
        const auto seen = geometry::project(world.truth[c], {truth_from_rig * point});
        if (!seen || !geometry::in_image(world.truth[c], *seen)) continue;
        const PixelPoint noisy{seen->v + Eigen::Vector2d(noise(random), noise(random))};
        const auto ray = geometry::undistort(evidence.rig[c].lens, noisy);
        if (ray) rays.push_back(sighting_of(evidence.rig[c], *ray, kNoise_px));
      }
      const auto sigma = position_sigma_m(evidence.rig, evidence.covariance, kNoise_px, point);
      const auto start = geometry::triangulate(rays);
      if (!start || !sigma) continue;
      const auto found = geometry::refine(rays, *start);
      ASSERT_TRUE(found);
      errors += (found->point.v - point).squaredNorm();
      predicted += *sigma * *sigma;
    }
  }
  EXPECT_NEAR(std::sqrt(predicted / errors), 1.0, 0.25);
}

TEST(AssessRig, PropagatesAKnownErrorOfTheRigToPoints) {
  const Rig truth = simworld::WandWorld({.cameras = 5}, kWand, 31).truth();
  std::mt19937 random(31);
  std::normal_distribution<double> small(0.0, 1e-4);  // m and rad: in the linear range
  Eigen::VectorXd off(30);
  Rig rig = truth;
  for (Eigen::Index c = 0; c < 5; ++c) {
    for (Eigen::Index i = 0; i < 6; ++i) off[6 * c + i] = small(random);
    CameraModel& camera = rig[static_cast<std::size_t>(c)];
    const Eigen::Vector3d centre = camera.centre().v + off.segment<3>(6 * c);
    const Eigen::Vector3d turn = off.segment<3>(6 * c + 3);  // of the camera, in the world
    camera.camera_from_world.rotation *=
        Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix().transpose();
    camera.camera_from_world.translation = -(camera.camera_from_world.rotation * centre);
  }
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0.2, -0.3, 1.0), Eigen::Vector3d(-0.5, 0.4, 1.4)}) {
    std::vector<geometry::Sighting> rays;
    for (std::size_t c = 0; c < 5; ++c) {
      const auto seen = geometry::project(truth[c], {point});
      if (!seen || !geometry::in_image(truth[c], *seen)) continue;
      rays.push_back(sighting_of(rig[c], *geometry::undistort(rig[c].lens, *seen), 0.1));
    }
    const auto found = geometry::refine(rays, *geometry::triangulate(rays));
    ASSERT_TRUE(found);

    const auto sigma = position_sigma_m(truth, off * off.transpose(), 1e-9, point);

    ASSERT_TRUE(sigma);
    EXPECT_NEAR(*sigma / (found->point.v - point).norm(), 1.0, 0.01);
  }
}

TEST(AssessRig, ComputesTheFiguresOfEachCamera) {
  const World world = solve(1);
  const RigEvidence evidence = evidence_of(world.solution, std::nullopt);

  const RigAssessment assessment = assess_rig(evidence);

  ASSERT_EQ(assessment.cameras.size(), world.solution.cameras.size());
  for (std::size_t c = 0; c < assessment.cameras.size(); ++c) {
    const CameraAccuracy& solved = world.solution.cameras[c];
    EXPECT_EQ(assessment.cameras[c].points, solved.points);
    EXPECT_NEAR(assessment.cameras[c].rms_px, solved.rms_px, 1e-9);
    EXPECT_NEAR(assessment.cameras[c].heldout_px.value(), solved.heldout_px.value(), 1e-9);
    EXPECT_NEAR(assessment.cameras[c].position_sigma_m.value(), solved.uncertainty.value().position_m, 1e-9);
    EXPECT_NEAR(assessment.cameras[c].rotation_sigma_rad.value(), solved.uncertainty.value().rotation_rad, 1e-9);
    EXPECT_LT(assessment.cameras[c].systematic_px, 0.05);  // a quarter of the noise: the lenses are correct
  }
  EXPECT_NEAR(assessment.wand->mean_m, world.solution.length_mean_m, 1e-12);
  EXPECT_NEAR(assessment.wand->std_m, world.solution.length_std_m, 1e-12);
  EXPECT_EQ(assessment.wand->min_m, world.solution.length_min_m);
  EXPECT_LE(assessment.grade, Grade::Good);
}

TEST(AssessRig, NamesACameraWithAWrongLens) {
  const World world = solve(2);
  RigEvidence evidence = evidence_of(world.solution, std::nullopt);
  for (ObservationResidual& observation : evidence.residuals) {
    const CameraModel& camera = evidence.rig[3];
    const Eigen::Vector2d from_middle = observation.at.v - Eigen::Vector2d(camera.lens.cx_px, camera.lens.cy_px);
    if (observation.camera == 3) observation.residual_px += 1.0 * from_middle / camera.lens.cx_px;  // 1 px at the rim
  }

  const RigAssessment assessment = assess_rig(evidence);

  EXPECT_TRUE(has_issue(assessment, Grade::Fair, "camera '" + evidence.rig[3].name + "': a systematic residual"));
  EXPECT_FALSE(has_issue(assessment, Grade::Good, "camera '" + evidence.rig[2].name + "': a systematic residual"));
}

TEST(AssessRig, GradesAnOverfittedRigAsPoor) {
  const World world = solve(3);
  RigEvidence evidence = evidence_of(world.solution, std::nullopt);
  for (ObservationResidual& observation : evidence.residuals) {
    if (observation.camera == 1 && observation.held_out) observation.residual_px *= 3.0;
  }

  const RigAssessment assessment = assess_rig(evidence);

  EXPECT_EQ(assessment.grade, Grade::Poor);
  EXPECT_TRUE(has_issue(assessment, Grade::Poor, "px rms on held-out samples, ")) << assessment.issues[0].text;
}

TEST(AssessRig, NamesTheSideOfAnImageWithoutPoints) {
  const World world = solve(4);
  RigEvidence evidence = evidence_of(world.solution, std::nullopt);
  const double third = evidence.rig[0].width_px / 3.0;
  std::erase_if(evidence.residuals, [&](const ObservationResidual& s) { return s.camera == 0 && s.at.v.x() > third; });

  const RigAssessment assessment = assess_rig(evidence);

  EXPECT_TRUE(has_issue(assessment, Grade::Good, "none right")) << assessment.issues.size();
}

TEST(AssessRig, AMeanLengthThatIsNotTheWandsIsReported) {
  const World world = solve(5);
  RigEvidence evidence = evidence_of(world.solution, std::nullopt);
  evidence.nominal_length_m *= 1.01;

  const RigAssessment assessment = assess_rig(evidence);

  EXPECT_NEAR(*assessment.wand_mismatch, 1.0 / 1.01 - 1.0, 1e-3);
  EXPECT_TRUE(has_issue(assessment, Grade::Poor, "measure the wand"));
}

TEST(AssessRig, GradesCamerasBelowTheFloorAsPoor) {
  const World world = solve(6);
  Floor floor;
  floor.world_from_rig.rotation = Eigen::AngleAxisd(3.14159265, Eigen::Vector3d::UnitX());
  floor.world_from_rig.position = {0.0, 0.0, -3.0};
  floor.rms_m = 0.001;

  const RigAssessment assessment = assess_rig(evidence_of(world.solution, floor));

  EXPECT_EQ(assessment.grade, Grade::Poor);
  EXPECT_TRUE(has_issue(assessment, Grade::Poor, "upside down"));
}

TEST(AssessRig, AnUndeterminedRigIsPoorAndHasNoUncertainty) {
  const World world = solve(8);
  RigEvidence evidence = evidence_of(world.solution, std::nullopt);
  evidence.covariance.resize(0, 0);

  const RigAssessment assessment = assess_rig(evidence);

  EXPECT_TRUE(has_issue(assessment, Grade::Poor, "do not determine the rig"));
  EXPECT_FALSE(assessment.cameras[0].position_sigma_m);
  EXPECT_FALSE(assessment.cameras[0].rotation_sigma_rad);
  EXPECT_FALSE(assessment.volume) << "the noise alone would give a small uncertainty";
}

TEST(AssessRig, ARigWithoutValidationIsAtBestFair) {
  const World world = solve(8);
  RigEvidence evidence = evidence_of(world.solution, std::nullopt);
  std::erase_if(evidence.residuals, [](const ObservationResidual& residual) { return residual.held_out; });

  const RigAssessment assessment = assess_rig(evidence);

  EXPECT_TRUE(has_issue(assessment, Grade::Fair, "the rig is not validated"));
  EXPECT_FALSE(assessment.heldout_px);
}

TEST(AssessRig, AVolumeThatNoTwoCamerasSeeIsPoor) {
  const World world = solve(8);
  RigEvidence evidence = evidence_of(world.solution, std::nullopt);
  for (Eigen::Vector3d& point : evidence.points_m) point.z() += 100.0;

  const RigAssessment assessment = assess_rig(evidence);

  EXPECT_TRUE(has_issue(assessment, Grade::Poor, "no point of the volume can be triangulated"));
}

TEST(AssessRig, NamesACameraWhoseSynchronisationWasNotChecked) {
  World world = solve(8);
  world.solution.cameras[2].synchronisation_checked = false;

  const RigAssessment assessment = assess_rig(evidence_of(world.solution, std::nullopt));

  const std::string part = "the synchronisation of camera '" + world.truth[2].name + "' was not checked";
  EXPECT_TRUE(has_issue(assessment, Grade::Fair, part));
  EXPECT_FALSE(has_issue(assessment, Grade::Good, "of camera '" + world.truth[1].name + "' was not checked"));
}

TEST(AssessRig, FiguresDoNotDependOnTheWorldFrame) {
  const World world = solve(7);
  Floor floor;
  floor.world_from_rig.rotation = Eigen::AngleAxisd(2.0, Eigen::Vector3d(0.3, -0.5, 0.8).normalized());
  floor.world_from_rig.position = {1.0, 2.0, 30.0};
  const RigEvidence a = evidence_of(world.solution, std::nullopt);
  const RigEvidence b = evidence_of(world.solution, floor);

  for (std::size_t i = 0; i < a.points_m.size(); i += 40) {
    const auto here = position_sigma_m(a.rig, a.covariance, 0.1, a.points_m[i]);
    const auto there = position_sigma_m(b.rig, b.covariance, 0.1, b.points_m[i]);
    ASSERT_EQ(here.has_value(), there.has_value());
    if (!here) continue;
    EXPECT_NEAR(*here / *there, 1.0, 1e-6);  // rounding: the sums are computed in other axes
  }
}

}  // namespace assess_rig_test
}  // namespace mocap::calibration
