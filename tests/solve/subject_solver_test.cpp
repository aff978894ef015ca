#include "solve/subject_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "kinematics/pose_fit.h"
#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::solve {
namespace subject_solver_test {

constexpr Timestamp kStart = from_ns(1'000'000'000);
constexpr Duration kStep = std::chrono::microseconds(8333);

// A person in T-pose whose markers are all measured.
struct Standing {
  Standing() : set(test::person("baseline41")), truth(set, kinematics::PoseFit::Lengths::Fixed) {
    labels.subject = SubjectId{0};
    labels.phase = SubjectPhase::Tracking;
    for (std::size_t m = 0; m < set.markers.size(); ++m) {
      LabelledMarker& label = labels.markers.push_back({});
      label.state = LabelState::Measured;
      label.position.v = truth.marker_at(m);
      label.covariance_m2 = 1e-8 * Eigen::Matrix3d::Identity();
    }
  }

  // Moves the root, and measures all markers.
  void stand(const Eigen::Vector3d& place_m, double yaw_rad) {
    std::vector<Pose> locals(truth.locals().begin(), truth.locals().end());
    locals[0] = {place_m, kinematics::from_rotation_vector({0.0, 0.0, yaw_rad})};
    measure(locals);
  }
  // Rotates one joint, and measures all markers.
  void bend(std::size_t bone, const Eigen::Vector3d& rotation_rad) {
    std::vector<Pose> locals(truth.locals().begin(), truth.locals().end());
    locals[bone].rotation = kinematics::from_rotation_vector(rotation_rad);
    measure(locals);
  }
  // The body model that the solver has.
  SubjectFit own_fit() const {
    SubjectFit fit;
    for (const Bone& bone : set.skeleton.bones) fit.rest_offsets_m.push_back(bone.rest_offset_m);
    for (const MarkerOnBone& marker : set.markers) fit.marker_offsets_m.push_back(marker.offset_m);
    return fit;
  }

  SubjectPose solve(SubjectSolver& solver, SubjectLabels of, int step = 0) {
    SubjectPose pose;
    solver.solve(of, {}, {}, kStart + step * kStep, pose);
    solved = of;
    return pose;
  }

  void measure(const std::vector<Pose>& locals) {
    truth.set_locals(locals);
    for (std::size_t m = 0; m < set.markers.size(); ++m) labels.markers[m].position.v = truth.marker_at(m);
  }

  MarkerSet set;
  kinematics::PoseFit truth;
  SubjectLabels labels;
  SubjectLabels solved;  // labels of the last solve, filled in
};

TEST(SubjectSolver, FindsThePoseInTheFirstSet) {
  Standing person;
  SubjectSolver solver({}, {"actor", person.set, true});

  const SubjectPose pose = person.solve(solver, person.labels);

  ASSERT_EQ(pose.bones.size(), person.set.skeleton.bones.size());
  for (std::size_t b = 0; b < pose.bones.size(); ++b) {
    const Eigen::Vector3d error = pose.bones[b].world_from_bone.position - person.truth.world()[b].position;
    EXPECT_LT(error.norm(), 0.001) << b;  // bias of the priors
  }
}

TEST(SubjectSolver, PublishesNoPoseOfASubjectThatIsNotTracked) {
  Standing person;
  SubjectSolver solver({}, {"actor", person.set, true});
  (void)person.solve(solver, person.labels);
  person.labels.phase = SubjectPhase::Lost;

  EXPECT_TRUE(person.solve(solver, person.labels, 1).bones.empty());
}

TEST(SubjectSolver, FillsInALabelThatWasNotMeasured) {
  Standing person;
  SubjectSolver solver({}, {"actor", person.set, true});
  (void)person.solve(solver, person.labels);
  const Eigen::Vector3d truth = person.labels.markers[0].position.v;
  person.labels.markers[0] = {};

  (void)person.solve(solver, person.labels, 1);

  EXPECT_EQ(person.solved.markers[0].state, LabelState::Filled);
  EXPECT_LT((person.solved.markers[0].position.v - truth).norm(), 0.005);  // the smallest standard deviation it reports
}

TEST(SubjectSolver, AdoptsANewBodyModelInTheNextSet) {
  Standing person;
  SubjectSolver solver({}, {"actor", person.set, true});
  (void)person.solve(solver, person.labels);
  SubjectFit fit = person.own_fit();
  fit.marker_offsets_m[0] += Eigen::Vector3d(0.0, 0.0, 0.02);

  solver.refit(fit);
  const double residual_m = person.solve(solver, person.labels, 1).residual_m;

  EXPECT_GT(residual_m, 0.001);  // one of 41 markers is 20 mm off in the new model: 3 mm rms at most
  EXPECT_LT(residual_m, 0.0032);
}

// The phase is Tracking in both sets, as after a reset in the T-pose of another person.
TEST(SubjectSolver, BeginsANewTrackWithANewIdentification) {
  Standing person;
  SubjectSolver solver({}, {"actor", person.set, true});
  (void)person.solve(solver, person.labels);
  person.stand({2.0, 1.0, 1.0}, std::numbers::pi);
  ++person.labels.identifications;

  const SubjectPose pose = person.solve(solver, person.labels, 1);

  ASSERT_EQ(pose.bones.size(), person.set.skeleton.bones.size());
  for (std::size_t b = 0; b < pose.bones.size(); ++b) {
    const Eigen::Vector3d error = pose.bones[b].world_from_bone.position - person.truth.world()[b].position;
    EXPECT_LT(error.norm(), 0.02) << b;
    EXPECT_EQ(pose.bones[b].velocity_m_s, Eigen::Vector3d::Zero()) << b;
  }
}

// A set that is older than the last one ends the track, and its markers determine no pose.
TEST(SubjectSolver, AppliesAFitOfATrackThatEndedBeforeLaterFits) {
  Standing person;
  SubjectSolver solver({}, {"actor", person.set, true});
  (void)person.solve(solver, person.labels);
  SubjectFit later = person.own_fit(), earlier = later;
  earlier.marker_offsets_m[0] += Eigen::Vector3d(0.0, 0.0, 0.02);
  SubjectLabels unseen = person.labels;
  for (LabelledMarker& label : unseen.markers) label = {};
  solver.refit(earlier);
  EXPECT_TRUE(person.solve(solver, unseen, -1).bones.empty());

  solver.refit(later);

  for (int step = 0; step < 3; ++step) EXPECT_LT(person.solve(solver, person.labels, step).residual_m, 0.0005) << step;
}

// The axes of the elbows were learned from a person whose arms are twisted by half a radian in T-pose.
TEST(SubjectSolver, ForgetsTheHingeAxesOfThePersonBeforeAtAnIdentification) {
  const auto elbow_after = [](bool is_same_person, int sets_before) {
    Standing person;
    const std::size_t elbow = test::bone_named(person.set, "LeftLowArm");
    SubjectSolver solver({}, {"actor", person.set, true});
    for (int step = 0; step < sets_before; ++step) {
      const double bend_rad = 0.8 + 0.5 * std::sin(0.1 * step);
      person.bend(elbow, bend_rad * Eigen::Vector3d(0.0, 0.5, -1.0).normalized());
      (void)person.solve(solver, person.labels, step);
    }
    person.labels.phase = SubjectPhase::Lost;
    (void)person.solve(solver, person.labels, sets_before);
    person.labels.phase = SubjectPhase::Tracking;
    ++person.labels.identifications;
    SubjectFit fit = person.own_fit();
    fit.at_identification = !is_same_person;
    solver.refit(fit);
    // One marker of the hand leaves the twist of the arm to the priors.
    person.bend(elbow, {0.0, 0.0, -1.0});
    for (const char* hidden : {"LUArmHigh", "LElbowOut", "LWristIn", "LWristOut", "LHandIn"})
      person.labels.markers[test::marker_named(person.set, hidden)] = {};
    SubjectPose pose;
    for (int step = 1; step < 10; ++step) pose = person.solve(solver, person.labels, sets_before + step);
    return pose.bones[elbow].parent_from_bone.rotation;
  };

  const Eigen::Quaterniond fresh = elbow_after(false, 0);

  EXPECT_GT(test::angle_between(elbow_after(true, 240), fresh), 0.1);
  EXPECT_LT(test::angle_between(elbow_after(false, 240), fresh), 0.02);
}

}  // namespace subject_solver_test
}  // namespace mocap::solve
