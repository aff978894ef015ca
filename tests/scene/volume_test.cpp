#include "scene/volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "geometry/lens.h"
#include "kinematics/kinematic_tree.h"
#include "scene/person.h"
#include "scene/procedural_actor.h"
#include "scene/random.h"
#include "scene/ring_rig.h"

namespace mocap::scene {
namespace volume_test {

// The joints of human18 with the lengths of an adult, one marker in each joint.
MarkerSet person() {
  struct Row {
    const char* name;
    int parent;
    Eigen::Vector3d offset;
  };
  const std::vector<Row> rows{{"Hips", -1, {0, 0, 0}},
                              {"Chest", 0, {-0.03, 0, 0.22}},
                              {"Neck", 1, {-0.01, 0, 0.28}},
                              {"Head", 2, {0.035, 0, 0.12}},
                              {"LeftCollar", 1, {0.03, 0.05, 0.2}},
                              {"LeftUpArm", 4, {-0.035, 0.13, 0.02}},
                              {"LeftLowArm", 5, {0, 0.28, 0}},
                              {"LeftHand", 6, {0.015, 0.25, 0}},
                              {"LeftUpLeg", 0, {0.02, 0.09, -0.05}},
                              {"LeftLowLeg", 8, {-0.01, 0, -0.42}},
                              {"LeftFoot", 9, {-0.045, 0, -0.41}},
                              {"RightCollar", 1, {0.03, -0.05, 0.2}},
                              {"RightUpArm", 11, {-0.035, -0.13, 0.02}},
                              {"RightLowArm", 12, {0, -0.28, 0}},
                              {"RightHand", 13, {0.015, -0.25, 0}},
                              {"RightUpLeg", 0, {0.02, -0.09, -0.05}},
                              {"RightLowLeg", 15, {-0.01, 0, -0.42}},
                              {"RightFoot", 16, {-0.045, 0, -0.41}}};
  MarkerSet set;
  for (const Row& row : rows) {
    Bone bone;
    bone.name = row.name;
    bone.parent = row.parent;
    bone.rest_offset_m = row.offset;
    set.markers.push_back({row.name, static_cast<int>(set.skeleton.bones.size()), {0, 0, 0}, {}});
    set.skeleton.bones.push_back(bone);
  }
  return set;
}

Program program(const char* text) { return *parse_program(text); }

TEST(ProceduralActor, StartsInTPoseInTheCentreOfTheVolume) {
  const auto actor = make_procedural_actor(person(), program("tpose:2,walk"));
  ActorState state;

  actor->at(0.5, state);

  for (const Pose& pose : state.world_from_bone)
    EXPECT_LT(pose.rotation.angularDistance(Eigen::Quaterniond::Identity()), 1e-12);
  EXPECT_NEAR(state.world_from_bone[10].position.z(), 0.08, 1e-9);  // a foot on the floor
  EXPECT_LT(state.world_from_bone[0].position.head<2>().norm(), 1e-12);
}

class EveryAct : public testing::TestWithParam<const char*> {};

TEST_P(EveryAct, HasHumanSpeedsAndStaysInTheVolume) {
  const auto actor = make_procedural_actor(person(), program(GetParam()));
  ActorState before, now;
  constexpr double kStep_s = 1.0 / 240.0;
  actor->at(0.0, before);
  std::vector<Eigen::Vector3d> speed_before(before.markers.size(), Eigen::Vector3d::Zero());
  for (double t_s = kStep_s; t_s < 24.0; t_s += kStep_s) {
    actor->at(t_s, now);
    for (std::size_t i = 0; i < now.markers.size(); ++i) {
      const Eigen::Vector3d speed = (now.markers[i].position.v - before.markers[i].position.v) / kStep_s;
      ASSERT_LT(speed.norm(), 6.0) << "m/s, marker " << i << " at " << t_s;
      ASSERT_LT((speed - speed_before[i]).norm(), 2.2) << "m/s within a step, marker " << i << " at " << t_s;
      ASSERT_LT(now.markers[i].position.v.head<2>().norm(), 2.2);
      ASSERT_GT(now.markers[i].position.v.z(), 0.0);
      speed_before[i] = speed;
    }
    ASSERT_LT(now.world_from_bone[0].position.head<2>().norm(), 1.2);
    before = now;
  }
}
INSTANTIATE_TEST_SUITE_P(All, EveryAct,
                         testing::Values("tpose:2,walk", "apose:2,walk", "wave", "jump", "spin", "crouch",
                                         "tpose:2,walk:5,wave:3,jump:4,spin:4,crouch:3,walk"));

TEST(Program, RefusesAWordThatIsNotAnAct) {
  for (const char* text : {"", "walk,", "dance:3", "walk:0", "walk:nan", "walk:-3", "walk:3s", "tpose:3;walk"}) {
    const auto parsed = parse_program(text);
    ASSERT_FALSE(parsed) << text;
    EXPECT_EQ(parsed.error().code, ErrorCode::InvalidArgument);
  }
}

TEST(SegmentDistance, AgreesWithTheNearestOfManyPointPairs) {
  Random random(3);
  const auto point = [&] { return Eigen::Vector3d(random.uniform(), random.uniform(), random.uniform()); };
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d a = point(), b = i % 10 == 0 ? a : point(), c = point(), d = i % 7 == 0 ? c : point();
    double nearest = 1e9;
    for (int s = 0; s <= 100; ++s) {
      for (int t = 0; t <= 100; ++t) {
        nearest = std::min(nearest, (a + (b - a) * (s / 100.0) - c - (d - c) * (t / 100.0)).norm());
      }
    }

    const double distance = segment_distance_m(a, b, c, d);

    EXPECT_LE(distance, nearest + 1e-12);
    EXPECT_NEAR(distance, nearest, 0.012);  // half a step of each segment
  }
}

TEST(Flesh, HidesAMarkerBehindTheTrunkOnly) {
  const MarkerSet set = person();
  ActorState state;
  make_procedural_actor(set, program("tpose"))->at(0.0, state);
  const Flesh flesh(set);
  const Eigen::Vector3d chest_m = state.world_from_bone[1].position + Eigen::Vector3d(0, 0, 0.1);
  state.markers[14].position.v = chest_m + Eigen::Vector3d(0.4, 0, 0);  // the right hand in front of the chest

  EXPECT_TRUE(flesh.hides(state, 14, chest_m - Eigen::Vector3d(4, 0, 0)));
  EXPECT_FALSE(flesh.hides(state, 14, chest_m + Eigen::Vector3d(4, 0, 0)));
  EXPECT_FALSE(flesh.hides(state, 0, chest_m + Eigen::Vector3d(4, 0, 0)));  // a marker on the trunk itself
}

TEST(RingRig, HasAWalkingPersonInAllImages) {
  const Volume volume(make_procedural_actor(person(), program("walk")), ring_rig({.cameras = 6}), {.occlusion = false});
  ActorState state;
  for (double t_s = 0.0; t_s < 16.0; t_s += 0.1) {
    volume.actor().at(t_s, state);
    for (std::size_t camera = 0; camera < 6; ++camera) {
      for (std::size_t i = 0; i < state.markers.size(); ++i) ASSERT_TRUE(volume.sees(camera, state, i)) << t_s;
    }
  }
}

TEST(Volume, GivesTheTrueStateOfEachMarkerAndBone) {
  const Volume volume(make_procedural_actor(person(), program("tpose:2,walk")), ring_rig({}), {});
  auto snapshot = std::make_unique<Snapshot>();

  volume.truth(4.2, from_ns(123), 9, *snapshot);

  ASSERT_EQ(snapshot->labels.size(), 1U);
  ASSERT_EQ(snapshot->labels[0].markers.size(), 18U);
  EXPECT_EQ(to_ns(snapshot->instants.exposed_at), 123);
  ActorState state;
  volume.actor().at(4.2, state);
  std::uint32_t sightings = 0, blobs = 0;
  for (std::size_t i = 0; i < 18; ++i) {
    const LabelledMarker& marker = snapshot->labels[0].markers[i];
    EXPECT_EQ(marker.position.v, state.markers[i].position.v);
    EXPECT_EQ(marker.state == LabelState::Measured, marker.cameras > 0);
    sightings += marker.cameras;
  }
  for (const ViewStatus& view : snapshot->views) blobs += view.blobs;
  EXPECT_EQ(sightings, blobs);
  const auto& bones = snapshot->poses[0].bones;
  const Pose again = bones[1].world_from_bone * bones[4].parent_from_bone;
  EXPECT_LT((again.position - bones[4].world_from_bone.position).norm(), 1e-12);
}

TEST(Eye, DrawsVisibleMarkersAtTheirProjections) {
  ImageSettings settings{.background_grey = 0.0, .read_noise_grey = 0.0, .electrons_per_grey = 0.0};
  const Volume volume(make_procedural_actor(person(), program("tpose")), ring_rig({}), settings);
  Eye eye(volume, 1);
  std::vector<std::byte> pixels(640 * 480);
  ActorState state;
  volume.actor().at(0.0, state);

  eye.see(0.0, 500e-6, 0, pixels);

  for (const std::size_t hand : {7U, 14U}) {
    const Eigen::Vector2d expected = geometry::project(volume.rig()[1], state.markers[hand].position)->v;
    double sum = 0.0;
    Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
    for (int y = static_cast<int>(expected.y()) - 5; y < expected.y() + 6; ++y) {
      for (int x = static_cast<int>(expected.x()) - 5; x < expected.x() + 6; ++x) {
        const double grey = std::to_integer<int>(pixels[static_cast<std::size_t>(y * 640 + x)]);
        sum += grey;
        centroid += grey * Eigen::Vector2d(x, y);
      }
    }
    ASSERT_GT(sum, 500.0);
    EXPECT_LT((centroid / sum - expected).norm(), 0.03);  // rounding to grey levels
  }
}

}  // namespace volume_test
}  // namespace mocap::scene
