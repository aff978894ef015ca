#include "solve/subject_solver.h"

#include <gtest/gtest.h>

#include "kinematics/pose_fit.h"
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

  SubjectPose solve(SubjectSolver& solver, SubjectLabels of, int step = 0) {
    SubjectPose pose;
    solver.solve(of, {}, {}, kStart + step * kStep, pose);
    solved = of;
    return pose;
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
  SubjectFit fit;
  for (const Bone& bone : person.set.skeleton.bones) fit.rest_offsets_m.push_back(bone.rest_offset_m);
  for (const MarkerOnBone& marker : person.set.markers) fit.marker_offsets_m.push_back(marker.offset_m);
  fit.marker_offsets_m[0] += Eigen::Vector3d(0.0, 0.0, 0.02);

  solver.refit(fit);
  const double residual_m = person.solve(solver, person.labels, 1).residual_m;

  EXPECT_GT(residual_m, 0.001);  // one of 41 markers is 20 mm off in the new model: 3 mm rms at most
  EXPECT_LT(residual_m, 0.0032);
}

}  // namespace subject_solver_test
}  // namespace mocap::solve
