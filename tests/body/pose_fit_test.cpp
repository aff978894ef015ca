#include "body/pose_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "body/rotation.h"
#include "body/test_body.h"

namespace mocap::body {
namespace {

using test::angle_between;
using test::person;
using test::random_pose;
using test::see;

TEST(RotationVector, AndTurnByAreEachOthersInverse) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 0.8);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d phi(normal(random), normal(random), normal(random));
    if (phi.norm() > 3.1) continue;

    EXPECT_LT((rotation_vector(turn_by(phi)) - phi).norm(), 1e-9);
  }
}

TEST(ChangeOfRotationVector, AgreesWithFiniteDifferences) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0.0, 0.8);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d phi(normal(random), normal(random), normal(random));
    if (phi.norm() > 2.8) continue;
    const Eigen::Matrix3d change = change_of_rotation_vector(phi);

    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d small = 1e-6 * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d slope =
          (rotation_vector(turn_by(small) * turn_by(phi)) - rotation_vector(turn_by(-small) * turn_by(phi))) / 2e-6;
      EXPECT_LT((slope - change.col(axis)).norm(), 1e-6);
    }
  }
}

TEST(PoseFit, FindsARandomPoseFromItsMarkersStartingAtRest) {
  const MarkerSet set = person("baseline41");
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    PoseFit truth(set, PoseFit::Lengths::Fixed);
    truth.set_locals(random_pose(set, 0.5, random));
    PoseFit fit(set, PoseFit::Lengths::Fixed);
    fit.place({truth.world()[0].position + Eigen::Vector3d(0.05, -0.03, 0.02), truth.world()[0].rotation});

    const PoseFitResult result = fit.solve(see(truth), PosePrior{.outlier_m = 0.3}, 60);

    // Priors of 3 rad bend an exact pose by less than a millimetre.
    EXPECT_LT(result.rms_m, 0.001);
    for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
      EXPECT_LT((fit.world()[b].position - truth.world()[b].position).norm(), 0.005) << set.skeleton.bones[b].name;
    }
  }
}

TEST(PoseFit, IsNotPulledAwayByOneWrongMarker) {
  const MarkerSet set = person("baseline41");
  PoseFit truth(set, PoseFit::Lengths::Fixed);
  std::vector<Observation> seen = see(truth);
  seen[20].position += Eigen::Vector3d(0.3, 0.1, 0.0);
  PoseFit fit(set, PoseFit::Lengths::Fixed);

  (void)fit.solve(seen, PosePrior{}, 30);

  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
    EXPECT_LT((fit.world()[b].position - truth.world()[b].position).norm(), 0.004) << set.skeleton.bones[b].name;
  }
}

TEST(PoseFit, FindsEveryJointOfOneMarkerAJoint) {
  const MarkerSet set = person("openmocap18");
  std::mt19937 random(4);
  for (int trial = 0; trial < 20; ++trial) {
    PoseFit truth(set, PoseFit::Lengths::Fixed);
    truth.set_locals(random_pose(set, 0.4, random));
    PoseFit fit(set, PoseFit::Lengths::Fixed);
    fit.place(truth.world()[0]);

    const PoseFitResult result = fit.solve(see(truth), PosePrior{.outlier_m = 0.5}, 60);

    EXPECT_LT(result.rms_m, 0.001);
  }
}

TEST(PoseFit, RecoversTheBoneLengthsOfAnotherBody) {
  const MarkerSet model = person("openmocap18");
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 0.001);
  std::uniform_real_distribution<double> stretch(0.9, 1.12);
  for (int trial = 0; trial < 10; ++trial) {
    MarkerSet other = model;
    for (Bone& bone : other.skeleton.bones) bone.rest_offset_m *= stretch(random);
    PoseFit truth(other, PoseFit::Lengths::Fixed);
    std::vector<Observation> seen = see(truth);
    for (Observation& one : seen) {
      one.position += Eigen::Vector3d(noise(random), noise(random), noise(random));
      one.sigma_m = 0.002;
    }
    PoseFit fit(model, PoseFit::Lengths::Free);

    const PoseFitResult result = fit.solve(seen, PosePrior{.rest_sigma_rad = 0.15, .outlier_m = 0.3}, 60);

    EXPECT_LT(result.rms_m, 0.002);
    for (std::size_t b = 1; b < other.skeleton.bones.size(); ++b) {
      // Two markers of 1 mm noise tell a length to 1.4 mm; four sigma, and the prior's pull.
      EXPECT_NEAR(fit.locals()[b].position.norm(), other.skeleton.bones[b].rest_offset_m.norm(), 0.007)
          << other.skeleton.bones[b].name;
    }
  }
}

TEST(PoseFit, StaysFiniteWhateverIsSeen) {
  const MarkerSet set = person("baseline41");
  PoseFit fit(set, PoseFit::Lengths::Fixed);
  const double nan = std::nan("");
  const std::vector<Observation> seen{{0, {nan, 0.0, 0.0}}, {1, {1e9, -1e9, 1e9}}, {2, {0.0, 0.0, 0.0}}};

  const PoseFitResult result = fit.solve(seen, PosePrior{}, 20);

  EXPECT_TRUE(std::isfinite(result.cost));
  for (const Pose& pose : fit.world()) {
    EXPECT_TRUE(pose.position.allFinite());
    EXPECT_NEAR(pose.rotation.norm(), 1.0, 1e-9);
  }
}

}  // namespace
}  // namespace mocap::body
