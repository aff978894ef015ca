#include "scene/prop_actor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace mocap::scene {
namespace prop_actor_test {

using Eigen::Vector3d;

TEST(PropActor, WavesAWandOfConstantLengthsThroughItsVolume) {
  const auto wand = make_prop_actor("wand:0,100,350");
  ASSERT_TRUE(wand) << wand.error().message;
  ActorState state;
  Vector3d low = Vector3d::Constant(1e9), high = Vector3d::Constant(-1e9);

  for (int i = 0; i < 6000; ++i) {
    (*wand)->at(0.02 * i, state);

    ASSERT_EQ(state.markers.size(), 3U);
    const Vector3d a = state.markers[0].position.v, b = state.markers[1].position.v, c = state.markers[2].position.v;
    EXPECT_NEAR((b - a).norm(), 0.10, 1e-9);
    EXPECT_NEAR((c - a).norm(), 0.35, 1e-9);
    EXPECT_NEAR((c - b).norm(), 0.25, 1e-9) << "on one line";
    const Vector3d middle = 0.5 * (a + c);
    low = low.cwiseMin(middle);
    high = high.cwiseMax(middle);
  }

  // The middle stays in the box of 2.6 x 2.6 x 1.5 m above the floor, and in two minutes covers 80 % of each side.
  const Vector3d box(2.6, 2.6, 1.5);
  EXPECT_LE(high.x(), 1.3);
  EXPECT_GE(low.x(), -1.3);
  EXPECT_GE(low.z(), 0.0);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LE(high[axis] - low[axis], box[axis]) << axis;
    EXPECT_GE(high[axis] - low[axis], 0.8 * box[axis]) << axis;
  }
}

TEST(PropActor, TurnsTheWandInAllDirections) {
  const auto wand = make_prop_actor("wand");
  ASSERT_TRUE(wand);
  ActorState state;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  constexpr int kInstants = 6000;

  for (int i = 0; i < kInstants; ++i) {
    (*wand)->at(0.02 * i, state);
    const Vector3d along = (state.markers.back().position.v - state.markers.front().position.v) / 0.5;
    EXPECT_NEAR(along.norm(), 1.0, 1e-9) << "0.5 m without numbers";
    scatter += along * along.transpose() / kInstants;
  }

  // Equal scatter would be a third along each axis.
  for (int axis = 0; axis < 3; ++axis) EXPECT_GT(scatter(axis, axis), 0.15) << axis;
}

TEST(PropActor, LaysAFrameOnTheFloor) {
  const auto frame = make_prop_actor("frame:700,300");
  ASSERT_TRUE(frame);
  ActorState state;

  (*frame)->at(12.5, state);

  ASSERT_EQ(state.markers.size(), 3U);
  EXPECT_EQ(state.markers[0].position.v, Vector3d::Zero());
  EXPECT_LT((state.markers[1].position.v - Vector3d(0.7, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_LT((state.markers[2].position.v - Vector3d(0.0, 0.3, 0.0)).norm(), 1e-12);
  EXPECT_EQ((*frame)->marker_set().markers.size(), 3U);
  EXPECT_TRUE(state.world_from_bone.empty());
}

TEST(PropActor, IsTheSameBeforeTheStartAsAtTheStart) {
  const auto wand = make_prop_actor("wand");
  ASSERT_TRUE(wand);
  ActorState before, start;

  (*wand)->at(-3.0, before);
  (*wand)->at(0.0, start);

  EXPECT_EQ(before.markers[0].position.v, start.markers[0].position.v);
}

TEST(PropActor, IsRefusedWithoutTheNumbersOfItsKind) {
  for (const char* text : {"wand:", "wand:160", "wand:0,-5", "wand:0,x", "wand:0,10001", "frame:600", "frame:1,2,3",
                           "cube:1,2", "", "wand:0;160"}) {
    const auto prop = make_prop_actor(text);

    ASSERT_FALSE(prop) << text;
    EXPECT_EQ(prop.error().code, ErrorCode::InvalidArgument);
    EXPECT_THAT(prop.error().message, testing::HasSubstr("expected wand:0,160,500"));
  }
}

TEST(PropActor, IsKnownByTheNameBeforeTheColon) {
  EXPECT_TRUE(is_prop("wand"));
  EXPECT_TRUE(is_prop("frame:600,400"));
  EXPECT_FALSE(is_prop("wander"));
  EXPECT_FALSE(is_prop("walk:20"));
}

}  // namespace prop_actor_test
}  // namespace mocap::scene
