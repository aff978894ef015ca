#include "scene/person.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "kinematics/rotation.h"
#include "scene/procedural_actor.h"
#include "support/test_body.h"

namespace mocap::scene {
namespace person_test {

MarkerSet with_fingers() { return test::person("baseline61"); }

const Bone& bone_named(const MarkerSet& set, std::string_view name) {
  return *std::ranges::find(set.skeleton.bones, name, &Bone::name);
}

// The act "hands" from the start, without a fade.
Posture hands_at(double t_s) { return posture_at(*parse_program("hands"), t_s); }

TEST(Hands, StayWithinTheRangesOfTheJoints) {
  const MarkerSet set = with_fingers();
  for (int i = 0; i < 900; ++i) {
    const Posture posture = hands_at(0.01 * i);
    for (std::size_t joint = 0; joint < kJoints; ++joint) {
      const Bone& bone = bone_named(set, kJointNames[joint]);
      if (bone.parent < 0) continue;
      const Eigen::Vector3d angles_rad = kinematics::rotation_vector(posture.rotations[joint]);
      for (int axis = 0; axis < 3; ++axis) {
        const AngleRange range = bone.rotation_limits[static_cast<std::size_t>(axis)].value_or(AngleRange{-0.2, 0.2});
        EXPECT_GE(angles_rad[axis], range.min_rad) << bone.name << " about axis " << axis << " at " << 0.01 * i;
        EXPECT_LE(angles_rad[axis], range.max_rad) << bone.name << " about axis " << axis << " at " << 0.01 * i;
      }
    }
  }
}

TEST(Hands, TouchEachOtherThenTheFace) {
  const MarkerSet set = with_fingers();
  const auto actor = make_procedural_actor(set, *parse_program("hands"));
  // The shortest distance between two markers whose names begin so, from one instant to another.
  const auto nearest_m = [&](double from_s, double to_s, const std::string& one, const std::string& other) {
    double nearest = 1e3;
    ActorState state;
    for (double t_s = from_s; t_s < to_s; t_s += 0.05) {
      actor->at(t_s, state);
      for (std::size_t a = 0; a < set.markers.size(); ++a) {
        for (std::size_t b = 0; b < set.markers.size(); ++b) {
          if (!set.markers[a].name.starts_with(one) || !set.markers[b].name.starts_with(other)) continue;
          nearest = std::min(nearest, (state.markers[a].position.v - state.markers[b].position.v).norm());
        }
      }
    }
    return nearest;
  };

  EXPECT_GT(nearest_m(0.0, 0.1, "LMiddle", "RMiddle"), 0.15);
  EXPECT_LT(nearest_m(0.0, 4.5, "LMiddle", "RMiddle"), 0.05);
  EXPECT_LT(nearest_m(4.5, 9.0, "RMiddle", "HeadFront"), 0.12);
}

}  // namespace person_test
}  // namespace mocap::scene
