#include "kinematics/pose_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "kinematics/joint_prior.h"
#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::kinematics {
namespace pose_fit_test {

using test::angle_between;
using test::person;
using test::random_pose;
using test::see;

TEST(Rotation, VectorAndQuaternionConversionsAreInverse) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 0.8);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d phi(normal(random), normal(random), normal(random));
    if (phi.norm() > 3.1) continue;

    EXPECT_LT((rotation_vector(from_rotation_vector(phi)) - phi).norm(), 1e-9);
  }
}

TEST(InverseLeftJacobian, AgreesWithFiniteDifferences) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0.0, 0.8);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d phi(normal(random), normal(random), normal(random));
    if (phi.norm() > 2.8) continue;
    const Eigen::Matrix3d change = inverse_left_jacobian(phi);

    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d small = 1e-6 * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d slope = (rotation_vector(from_rotation_vector(small) * from_rotation_vector(phi)) -
                                     rotation_vector(from_rotation_vector(-small) * from_rotation_vector(phi))) /
                                    2e-6;
      EXPECT_LT((slope - change.col(axis)).norm(), 1e-6);
    }
  }
}

TEST(PoseFit, FindsARandomPoseFromTheRestPose) {
  const MarkerSet set = person("baseline41");
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    PoseFit truth(set, PoseFit::Lengths::Fixed);
    truth.set_locals(random_pose(set, 0.5, random));
    PoseFit fit(set, PoseFit::Lengths::Fixed);
    fit.place({truth.world()[0].position + Eigen::Vector3d(0.05, -0.03, 0.02), truth.world()[0].rotation});

    const PoseFitResult result = fit.solve(see(truth), PosePrior{.outlier_m = 0.3}, 60);

    // Rest pose priors with a standard deviation of 3 rad bias an exact pose by less than a millimetre.
    EXPECT_LT(result.rms_m, 0.001);
    for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
      EXPECT_LT((fit.world()[b].position - truth.world()[b].position).norm(), 0.005) << set.skeleton.bones[b].name;
    }
  }
}

TEST(PoseFit, IsNotBiasedByOneOutlier) {
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

TEST(PoseFit, FindsThePoseOfABodyWithOneMarkerPerJoint) {
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
      // Two markers with 1 mm noise determine a length to 1.4 mm: four standard deviations, and the bias of the prior.
      EXPECT_NEAR(fit.locals()[b].position.norm(), other.skeleton.bones[b].rest_offset_m.norm(), 0.007)
          << other.skeleton.bones[b].name;
    }
  }
}

TEST(PoseFit, StaysFiniteForUnusableObservations) {
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

TEST(LeftJacobian, IsTheInverseOfInverseLeftJacobian) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 0.8);
  for (const double scale : {1e-3, 0.05, 1.0}) {
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d phi = scale * Eigen::Vector3d(normal(random), normal(random), normal(random));

      EXPECT_LT((left_jacobian(phi) * inverse_left_jacobian(phi) - Eigen::Matrix3d::Identity()).norm(), 1e-9);
    }
  }
}

// The oracle is central differences of the cost.
TEST(JointPrior, GradientAgreesWithFiniteDifferences) {
  Bone bone;
  bone.parent = 0;
  bone.rotation_limits = {AngleRange{-0.3, 0.2}, AngleRange{-0.1, 1.0}, AngleRange{-1.5, 0.1}};
  Bone hinge = bone;
  hinge.rotation_limits[0] = hinge.rotation_limits[2] = std::nullopt;
  const std::vector<Eigen::Matrix3d> information{
      (Eigen::Matrix3d() << 9.0, 1.0, 0.0, 1.0, 30.0, 2.0, 0.0, 2.0, 4.0).finished()};
  const PosePrior prior{
      .rest_sigma_rad = 0.7, .rest_range_fraction = 0.5, .limit_sigma_rad = 0.2, .prior_information = information};
  std::mt19937 random(8);
  std::normal_distribution<double> normal(0.0, 0.5);
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d tilted = from_rotation_vector({0.0, 0.6, 0.0}).toRotationMatrix();
  for (const auto& [one, nominal_from_calibrated] :
       {std::pair(bone, identity), std::pair(hinge, identity), std::pair(bone, tilted)}) {
    JointPrior joint(one, false);
    joint.set_hinge_axis(nominal_from_calibrated);
    joint.set(prior, 0);
    for (int i = 0; i < 20; ++i) {
      const auto any = [&] { return from_rotation_vector({normal(random), normal(random), normal(random)}); };
      const Eigen::Quaterniond local = joint.project_to_free_axes(any()), prior_rotation = any();
      (void)joint.evaluate(local, prior_rotation);
      JointTerms terms;
      joint.add(Eigen::Matrix3d::Identity(), terms);

      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d small = 1e-6 * Eigen::Vector3d::Unit(axis);
        const double slope = 0.5 *
                             (joint.evaluate(joint.apply_step(local, small), prior_rotation) -
                              joint.evaluate(joint.apply_step(local, -small), prior_rotation)) /
                             2e-6;
        EXPECT_NEAR(slope, terms.gradient[axis], 1e-5 * std::max(1.0, std::abs(slope)));
      }
    }
  }
}

TEST(PoseFit, KeepsLockedAxesAtZero) {
  MarkerSet set = person("baseline41");
  for (Bone& bone : set.skeleton.bones) {
    // Knees and elbows as one-axis joints.
    if (bone.name.ends_with("LowLeg")) bone.rotation_limits[0] = bone.rotation_limits[2] = std::nullopt;
    if (bone.name.ends_with("LowArm")) bone.rotation_limits[0] = bone.rotation_limits[1] = std::nullopt;
  }
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0.0, 0.003);
  PoseFit truth(set, PoseFit::Lengths::Fixed);
  truth.set_locals(random_pose(set, 0.5, random));
  std::vector<Observation> seen = see(truth);
  for (Observation& one : seen) one.position += Eigen::Vector3d(noise(random), noise(random), noise(random));
  PoseFit fit(set, PoseFit::Lengths::Fixed);
  fit.place(truth.world()[0]);

  const PoseFitResult result = fit.solve(seen, PosePrior{.outlier_m = 0.3}, 60);

  EXPECT_LT(result.rms_m, 0.006);  // 3 mm noise in each of three axes
  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
    const Eigen::Vector3d phi = rotation_vector(fit.locals()[b].rotation);
    const bool knee = set.skeleton.bones[b].name.ends_with("LowLeg");
    const bool elbow = set.skeleton.bones[b].name.ends_with("LowArm");
    EXPECT_LT(knee ? std::hypot(phi.x(), phi.z()) : elbow ? std::hypot(phi.x(), phi.y()) : 0.0, 1e-9);
    // 3 mm noise on markers 5 cm beside the axis of the limb.
    const double error_rad = angle_between(fit.world()[b].rotation, truth.world()[b].rotation);
    EXPECT_LT(knee || elbow ? error_rad : 0.0, 0.15);
  }
}

TEST(PoseFit, HasNoUncertaintyAboutALockedAxis) {
  MarkerSet set = person("baseline41");
  for (Bone& bone : set.skeleton.bones) {
    if (bone.name == "LeftLowArm") bone.rotation_limits[0] = bone.rotation_limits[1] = std::nullopt;
  }
  const std::size_t elbow = test::bone_named(set, "LeftLowArm");
  std::mt19937 random(3);
  PoseFit fit(set, PoseFit::Lengths::Fixed);
  fit.set_locals(random_pose(set, 0.5, random));
  (void)fit.solve(see(fit), {}, 5);

  ASSERT_TRUE(fit.compute_covariances(see(fit), {}));

  const Eigen::Matrix3d covariance = fit.local_covariance(elbow);
  EXPECT_LT(covariance(0, 0), 1e-12);
  EXPECT_LT(covariance(1, 1), 1e-12);
  EXPECT_GT(covariance(2, 2), 1e-8);
  EXPECT_LT(covariance(2, 2), 0.1);
}

// Moving the marker along the ray has no cost, so the smallest displacement is across the ray.
TEST(PoseFit, MovesAMarkerAcrossARayAndNotAlongIt) {
  const MarkerSet set = person("rigid4");
  PoseFit fit(set, PoseFit::Lengths::Fixed);
  const Eigen::Vector3d marker = fit.marker_at(0);
  const Eigen::Vector3d eye(0.0, -4.0, 0.5), direction = (marker + Eigen::Vector3d(0.05, 0.0, 0.0) - eye).normalized();
  const double prior_sigma_rad = 1e-3;
  const PosePrior prior{.prior_sigma_rad = {&prior_sigma_rad, 1}, .prior_root_sigma_m = 1.0, .outlier_m = 10.0};

  const PoseFitResult result = fit.solve(std::vector{observe_ray(0, eye, direction, 1e-4, marker, 0.001)}, prior, 20);

  EXPECT_TRUE(result.converged);
  const Eigen::Vector3d off = fit.marker_at(0) - eye;
  EXPECT_LT((off - direction * direction.dot(off)).norm(), 1e-5);
  // The shortest way to the ray is across it.
  EXPECT_LT(std::abs((fit.marker_at(0) - marker).dot(direction)), 1e-4);
}

// Two observations of one marker disagree by 20 mm along x, with standard deviations of 30 and 10 mm.
TEST(PoseFit, WeightsEachDirectionOfAnObservationByItsCovariance) {
  const MarkerSet set = person("rigid4");
  PoseFit fit(set, PoseFit::Lengths::Fixed);
  const Eigen::Vector3d place = fit.marker_at(0), right(0.02, 0.0, 0.0);
  const auto covariance = [](double x_m, double y_m) {
    return Eigen::Matrix3d(Eigen::Vector3d(x_m * x_m, y_m * y_m, 1e-6).asDiagonal());
  };
  const std::vector<Observation> seen{observe_point(0, place, covariance(0.03, 0.001), 1e-6),
                                      observe_point(0, place + right, covariance(0.01, 0.001), 1e-6)};
  const double prior_sigma_rad = 1e-4;

  (void)fit.solve(seen,
                  PosePrior{.prior_sigma_rad = {&prior_sigma_rad, 1}, .prior_root_sigma_m = 1e3, .outlier_m = 1e3}, 20);

  // Inverse variances weight the observations 1 : 9.
  EXPECT_NEAR((fit.marker_at(0) - place).x(), 0.9 * 0.02, 1e-5);
}

}  // namespace pose_fit_test
}  // namespace mocap::kinematics
