#include "lib/join/pose_offset.h"

#include <gtest/gtest.h>

#include <numbers>

namespace mocap::join {
namespace pose_offset_test {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

// An arm: a root, an upper and a lower bone, each 0.3 m.
Skeleton arm() {
  Skeleton skeleton;
  for (int b = 0; b < 3; ++b) {
    Bone& bone = skeleton.bones.emplace_back();
    bone.parent = b - 1;
  }
  return skeleton;
}

// `twist_rad`: of the upper bone about its own axis, which the lower bone undoes. `bend_rad`: of the lower bone.
v1::SubjectState pose(double twist_rad, double bend_rad, double root_x_m = 0.0) {
  const Quaterniond twist(AngleAxisd(twist_rad, Vector3d::UnitX())), bend(AngleAxisd(bend_rad, Vector3d::UnitZ()));
  const Quaterniond turned(AngleAxisd(0.8, Vector3d(0.0, 0.6, 0.8)));  // so that no axis of a bone is one of the world
  const Quaterniond locals[] = {turned, twist, twist.conjugate() * bend};
  v1::SubjectState state;
  v1::BonePoses& bones = *state.mutable_bones();
  Vector3d position(root_x_m, 0.0, 1.0);
  Quaterniond rotation = Quaterniond::Identity();
  for (int b = 0; b < 3; ++b) {
    const Vector3d local = b == 0 ? position : Vector3d(0.3, 0.0, 0.0);
    if (b > 0) position += rotation * local;
    rotation = rotation * locals[b];
    bones.add_states(v1::BONE_STATE_MEASURED);
    for (int axis = 0; axis < 3; ++axis) {
      bones.add_world_positions_m(static_cast<float>(position[axis]));
      bones.add_local_positions_m(static_cast<float>(local[axis]));
    }
    for (int axis = 0; axis < 4; ++axis) {
      bones.add_world_rotations_xyzw(static_cast<float>(rotation.coeffs()[axis]));
      bones.add_local_rotations_xyzw(static_cast<float>(locals[b].coeffs()[axis]));
    }
  }
  return state;
}

Quaterniond rotation_of(const v1::SubjectState& state, int bone) {
  const float* const q = state.bones().world_rotations_xyzw().data() + std::ptrdiff_t{4} * bone;
  return {q[3], q[0], q[1], q[2]};
}

Vector3d joint_of(const v1::SubjectState& state, int bone) {
  const float* const p = state.bones().world_positions_m().data() + std::ptrdiff_t{3} * bone;
  return {p[0], p[1], p[2]};
}

void expect_near(const v1::SubjectState& one, const v1::SubjectState& other) {
  for (int b = 0; b < 3; ++b) {
    EXPECT_LT(rotation_of(one, b).angularDistance(rotation_of(other, b)), 1e-5) << b;
    EXPECT_LT((joint_of(one, b) - joint_of(other, b)).norm(), 1e-6) << b;
  }
}

TEST(PoseOffsetOfChunks, BeginsWithTheEarlierPoseAndEndsWithTheLaterOne) {
  const v1::SubjectState earlier = pose(1.9, 0.5, 0.02), later = pose(0.2, 0.6);
  const Skeleton skeleton = arm();
  const PoseOffset offset(earlier, later, skeleton);
  v1::SubjectState at_once = later, in_the_end = pose(0.3, 0.9);

  offset.add_to(at_once, Duration{});
  offset.add_to(in_the_end, PoseOffset::kDecay);

  expect_near(at_once, earlier);
  EXPECT_EQ(in_the_end.SerializeAsString(), pose(0.3, 0.9).SerializeAsString());
}

TEST(PoseOffsetOfChunks, KeepsJointsWhereOnlyTheTwistDiffers) {
  const Skeleton skeleton = arm();
  const PoseOffset offset(pose(0.9 * kPi, 0.7), pose(0.0, 0.7), skeleton);

  for (int percent = 0; percent <= 100; percent += 10) {
    v1::SubjectState moved = pose(0.0, 1.1);
    offset.add_to(moved, PoseOffset::kDecay * percent / 100);

    for (int b = 0; b < 3; ++b) EXPECT_LT((joint_of(moved, b) - joint_of(pose(0.0, 1.1), b)).norm(), 1e-6) << percent;
  }
}

TEST(PoseOffsetOfChunks, ChangesNoLocalThatContradictsTheWorld) {
  const Skeleton skeleton = arm();
  const PoseOffset offset(pose(1.0, 0.5, 0.01), pose(0.2, 0.6), skeleton);
  v1::SubjectState moved = pose(0.4, 0.8);

  offset.add_to(moved, PoseOffset::kDecay / 3);

  Quaterniond rotation = Quaterniond::Identity();
  Vector3d position = Vector3d::Zero();
  for (int b = 0; b < 3; ++b) {
    const float* const p = moved.bones().local_positions_m().data() + std::ptrdiff_t{3} * b;
    const float* const q = moved.bones().local_rotations_xyzw().data() + std::ptrdiff_t{4} * b;
    position += rotation * Vector3d(p[0], p[1], p[2]);
    rotation = rotation * Quaterniond(q[3], q[0], q[1], q[2]);
    EXPECT_LT((joint_of(moved, b) - position).norm(), 1e-6) << b;
    EXPECT_LT(rotation_of(moved, b).angularDistance(rotation), 1e-5) << b;
  }
}

TEST(PoseOffsetOfChunks, LeavesLostBonesAndWrongColumns) {
  const Skeleton skeleton = arm();
  v1::SubjectState lost = pose(1.0, 0.5), short_columns = pose(1.0, 0.5);
  for (int b = 0; b < 3; ++b) lost.mutable_bones()->set_states(b, v1::BONE_STATE_LOST);
  short_columns.mutable_bones()->mutable_local_positions_m()->Truncate(8);
  v1::SubjectState first = pose(0.0, 0.5), second = first, third = short_columns;

  PoseOffset(lost, first, skeleton).add_to(first, Duration{});
  PoseOffset(short_columns, second, skeleton).add_to(second, Duration{});
  PoseOffset(pose(1.0, 0.5), pose(0.0, 0.5), skeleton).add_to(third, Duration{});

  expect_near(first, pose(0.0, 0.5));
  EXPECT_EQ(second.SerializeAsString(), pose(0.0, 0.5).SerializeAsString());
  EXPECT_EQ(third.SerializeAsString(), short_columns.SerializeAsString());
}

}  // namespace pose_offset_test
}  // namespace mocap::join
