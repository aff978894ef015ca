#include "scene/placed_actor.h"

#include <gtest/gtest.h>

#include <numbers>

#include "scene/occlusion.h"

namespace mocap::scene {
namespace placed_actor_test {

// One bone and one marker that move along +x at 1 m/s.
class Walker final : public Actor {
 public:
  Walker() {
    set_.skeleton.bones.push_back({});
    set_.markers.push_back({"m", 0, Eigen::Vector3d(0.0, 0.1, 0.0), {}});
  }
  const MarkerSet& marker_set() const override { return set_; }
  void at(double t_s, ActorState& into) const override {
    const double x_m = std::max(0.0, t_s);
    into = {};
    into.world_from_bone.push_back({{x_m, 0.0, 1.0}, Eigen::Quaterniond::Identity()});
    into.markers.push_back({{Eigen::Vector3d(x_m, 0.1, 1.0)}, true});
    into.ghosts.push_back({Eigen::Vector3d(0.0, 0.0, 2.0)});
  }

 private:
  MarkerSet set_;
};

TEST(PlacedActor, RotatesMovesAndDelaysTheMotion) {
  const auto actor = make_placed_actor(std::make_unique<Walker>(),
                                       {.at_m = {3.0, 1.0}, .heading_rad = 0.5 * std::numbers::pi, .delay_s = 2.0});
  ActorState state;

  actor->at(1.0, state);
  EXPECT_TRUE(state.markers[0].position.v.isApprox(Eigen::Vector3d(2.9, 1.0, 1.0), 1e-12));
  actor->at(2.5, state);

  EXPECT_TRUE(state.markers[0].position.v.isApprox(Eigen::Vector3d(2.9, 1.5, 1.0), 1e-12));
  EXPECT_TRUE(state.world_from_bone[0].position.isApprox(Eigen::Vector3d(3.0, 1.5, 1.0), 1e-12));
  EXPECT_TRUE((state.world_from_bone[0].rotation * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY(), 1e-12));
  EXPECT_TRUE(state.ghosts[0].v.isApprox(Eigen::Vector3d(3.0, 1.0, 2.0), 1e-12));
}

// A vertical trunk with a radius of 12 cm, and a marker of an arm.
struct Trunk {
  Trunk() {
    const char* names[] = {"Hips", "Chest", "LeftUpArm", "LeftLowArm"};
    for (int i = 0; i < 4; ++i) {
      Bone& bone = set.skeleton.bones.emplace_back();
      bone.name = names[i];
      bone.parent = i - 1;
    }
    set.markers.push_back({"m", 3, Eigen::Vector3d::Zero(), {}});
    state.world_from_bone.push_back({{0.0, 0.0, 1.0}, Eigen::Quaterniond::Identity()});
    state.world_from_bone.push_back({{0.0, 0.0, 1.5}, Eigen::Quaterniond::Identity()});
    state.world_from_bone.push_back({{0.0, 1.0, 1.5}, Eigen::Quaterniond::Identity()});
    state.world_from_bone.push_back({{0.0, 2.0, 1.5}, Eigen::Quaterniond::Identity()});
    state.markers.push_back({{Eigen::Vector3d::Zero()}, true});
  }
  bool hides(const Eigen::Vector3d& marker_m, const Eigen::Vector3d& eye_m) {
    state.markers[0].position.v = marker_m;
    return Flesh(set).hides(state, 0, eye_m);
  }
  MarkerSet set;
  ActorState state;
};

TEST(Flesh, DoesNotHideAMarkerFromTheSideOnWhichItLies) {
  Trunk trunk;
  const Eigen::Vector3d before(4.0, 0.0, 1.2), behind(-4.0, 0.0, 1.2);

  EXPECT_FALSE(trunk.hides({0.2, 0.0, 1.2}, before));
  EXPECT_TRUE(trunk.hides({0.2, 0.0, 1.2}, behind));
  EXPECT_FALSE(trunk.hides({0.08, 0.0, 1.2}, before));  // 4 cm below the surface of the capsule
  EXPECT_TRUE(trunk.hides({0.08, 0.0, 1.2}, behind));
}

TEST(Flesh, HidesPointsOfOtherSubjects) {
  const Trunk trunk;
  const Flesh flesh(trunk.set);

  EXPECT_TRUE(flesh.hides(trunk.state, Eigen::Vector3d(0.5, 0.0, 1.2), Eigen::Vector3d(-4.0, 0.0, 1.2)));
  EXPECT_FALSE(flesh.hides(trunk.state, Eigen::Vector3d(0.5, 0.0, 1.2), Eigen::Vector3d(4.0, 0.0, 1.2)));
  EXPECT_FALSE(flesh.hides(ActorState{}, Eigen::Vector3d(0.5, 0.0, 1.2), Eigen::Vector3d(-4.0, 0.0, 1.2)));
}

}  // namespace placed_actor_test
}  // namespace mocap::scene
