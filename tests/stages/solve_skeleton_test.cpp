#include "stages/solve_skeleton.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "body/kinematic_tree.h"
#include "body/rotation.h"
#include "body/test_body.h"

namespace mocap::stages {
namespace {

constexpr double kStep_s = 1.0 / 120.0;

// Somebody whose markers are named without fault; a test says which are seen. Truth comes by forward kinematics alone.
class World {
 public:
  explicit World(const std::string& name, const SolveSettings& settings = {})
      : set_(test::person(name)),
        solver_(make_skeleton_solver(settings, {{"actor", set_, true}})),
        truth_(set_.skeleton.bones.size()),
        shows_(set_.markers.size(), true) {
    labels_.resize(1);
    labels_[0].subject = SubjectId{0};
    labels_[0].phase = SubjectPhase::Tracking;
  }

  std::size_t marker(const std::string& name) const {
    std::size_t m = 0;
    while (set_.markers[m].name != name) ++m;
    return m;
  }
  std::size_t bone(const std::string& name) const {
    std::size_t b = 0;
    while (set_.skeleton.bones[b].name != name) ++b;
    return b;
  }
  const MarkerSet& set() const { return set_; }
  double t_s() const { return sets_ * kStep_s; }
  void show(std::size_t m, bool shown) { shows_[m] = shown; }
  void show_all(bool shown) { std::fill(shows_.begin(), shows_.end(), shown); }
  void see_by_ray(std::size_t m, const Eigen::Vector3d& eye) { ray_eyes_.emplace_back(m, eye); }
  void see_no_rays() { ray_eyes_.clear(); }
  void noise(double sigma_m) { noise_m_ = sigma_m; }
  /// How fast it moves, against what is usual.
  void pace(double factor) { pace_ = factor; }
  void bend_left_hand(const Eigen::Vector3d& phi) { left_hand_ = phi; }
  /// The body is known anew, as it was known.
  void refit() {
    SubjectFit fit;
    for (const Bone& one : set_.skeleton.bones) fit.rest_offsets_m.push_back(one.rest_offset_m);
    for (const MarkerOnBone& one : set_.markers) fit.marker_offsets_m.push_back(one.offset_m);
    solver_->refit(fit);
  }
  void spoil(std::size_t m, const Eigen::Vector3d& place) { spoiled_.emplace_back(m, place); }

  Eigen::Vector3d true_marker(std::size_t m) const {
    const MarkerOnBone& on = set_.markers[m];
    return truth_[static_cast<std::size_t>(on.bone)] * on.offset_m;
  }
  const Pose& true_bone(std::size_t b) const { return truth_[b]; }
  const SubjectPose& pose() const { return *pose_; }
  const BonePose& shown(std::size_t b) const { return pose_->bones[b]; }
  const LabelledMarker& label(std::size_t m) const { return labels_[0].markers[m]; }
  double off_m(std::size_t b) const { return (shown(b).world_from_bone.position - truth_[b].position).norm(); }

  /// Two arms that swing, an elbow that bends, a body that goes and turns.
  void step(int count = 1) {
    for (int i = 0; i < count; ++i) step_once();
  }

 private:
  void move() {
    const double t = moved_s_;
    moved_s_ += pace_ * kStep_s;
    std::vector<Eigen::Quaterniond> turns;
    for (const Bone& one : set_.skeleton.bones) {
      Eigen::Vector3d phi = Eigen::Vector3d::Zero();
      if (one.parent < 0) phi = {0.0, 0.05 * std::sin(2.0 * t), 0.3 * std::sin(0.8 * t)};
      if (one.name == "LeftUpArm") phi = {-0.9, 0.0, 0.5 * std::sin(4.0 * t)};
      if (one.name == "RightUpArm") phi = {0.9, 0.0, 0.5 * std::sin(4.0 * t)};
      if (one.name == "LeftLowArm") phi = {0.0, 0.0, -0.7 - 0.5 * std::sin(4.0 * t)};
      if (one.name == "RightLowArm") phi = {0.0, 0.0, 0.7 - 0.4 * std::sin(4.0 * t)};
      if (one.name == "LeftHand") phi = left_hand_;
      if (one.name == "LeftUpLeg") phi = {0.0, 0.4 * std::sin(4.0 * t), 0.0};
      if (one.name == "RightUpLeg") phi = {0.0, -0.4 * std::sin(4.0 * t), 0.0};
      if (one.name == "LeftLowLeg") phi = {0.0, 0.5 + 0.4 * std::sin(4.0 * t), 0.0};
      turns.push_back(body::turn_by(phi));
    }
    body::forward(set_.skeleton, {0.3 * std::sin(t), 0.2 * t, 1.0}, turns, truth_);
  }

  void step_once() {
    move();
    labels_[0].markers.clear();
    for (std::size_t m = 0; m < shows_.size(); ++m) {
      LabelledMarker& label = labels_[0].markers.push_back({});
      if (!shows_[m]) continue;
      label.state = LabelState::Measured;
      label.position.v = true_marker(m);
      for (int axis = 0; axis < 3; ++axis) label.position.v[axis] += noise_m_ * normal_(random_);
      label.covariance_m2 = (noise_m_ * noise_m_ + 1e-8) * Eigen::Matrix3d::Identity();
      label.cameras = 4;
    }
    for (const auto& [m, place] : spoiled_) labels_[0].markers[m].position.v = place;
    std::vector<NamedRay> rays;
    for (const auto& [m, eye] : ray_eyes_) {
      const Label label{SubjectId{0}, static_cast<std::uint32_t>(m)};
      rays.push_back({label, CameraId{3}, {eye}, (true_marker(m) - eye).normalized(), 1e-4});
    }
    pose_ = &solver_->solve(labels_, from_ns(1'000'000'000) + from_s(t_s()), rays)[0];
    ++sets_;
  }

  MarkerSet set_;
  std::unique_ptr<SkeletonSolver> solver_;
  std::vector<Pose> truth_;
  std::vector<bool> shows_;
  std::vector<std::pair<std::size_t, Eigen::Vector3d>> ray_eyes_;
  std::vector<std::pair<std::size_t, Eigen::Vector3d>> spoiled_;
  Labels labels_;
  const SubjectPose* pose_ = nullptr;
  double noise_m_ = 0.0;
  double pace_ = 1.0;
  double moved_s_ = 0.0;
  Eigen::Vector3d left_hand_ = Eigen::Vector3d::Zero();
  int sets_ = 0;
  std::mt19937 random_{11};
  std::normal_distribution<double> normal_;
};

TEST(SolveSkeleton, FindsJointsAndTurnsOfAMovingBody) {
  World world("baseline41");
  world.noise(0.0002);
  double place2 = 0.0, turn2 = 0.0;
  int count = 0;

  for (int i = 0; i < 360; ++i) {
    world.step();
    for (std::size_t b = 0; b < world.set().skeleton.bones.size(); ++b) {
      place2 += std::pow(world.off_m(b), 2);
      turn2 += std::pow(test::angle_between(world.shown(b).world_from_bone.rotation, world.true_bone(b).rotation), 2);
      ++count;
    }
  }

  // 0.2 mm on levers of 6 cm and more, and the pull of priors; the issue asks for 3 mm and 1 degree.
  EXPECT_LT(std::sqrt(place2 / count), 0.0005);
  EXPECT_LT(std::sqrt(turn2 / count), 0.010);
}

TEST(SolveSkeleton, ABodyKnownAnewInTheMidstOfASwingDoesNotStray) {
  for (const char* set : {"baseline41", "openmocap18"}) {
    World world(set);
    world.pace(0.0);
    world.step(120);
    world.pace(4.0);
    world.step(4);
    world.refit();

    double most_m = 0.0;
    for (int i = 0; i < 24; ++i) {
      world.step();
      for (std::size_t b = 0; b < world.set().skeleton.bones.size(); ++b) most_m = std::max(most_m, world.off_m(b));
    }

    // Nothing is known otherwise than before; the fit's own error is under a millimetre.
    EXPECT_LT(most_m, 0.002) << set;
  }
}

TEST(SolveSkeleton, AHandThatShowsOneMarkerKeepsItsTurn) {
  World world("baseline41");
  world.pace(0.0);
  world.bend_left_hand({-0.4, 0.15, -0.95});  // farther than hands commonly are
  world.step(60);
  world.show(world.marker("LHandIn"), false);
  world.step(84);  // 0.7 s

  const std::size_t hand = world.bone("LeftHand");
  const double off_rad = world.shown(hand).world_from_bone.rotation.angularDistance(world.true_bone(hand).rotation);
  // What is common takes over within seconds, not at once.
  EXPECT_LT(off_rad, 0.1);
}

TEST(SolveSkeleton, LocalPosesMakeUpTheWorldPoses) {
  World world("baseline41", {.smoothing = {.min_cutoff_hz = 2.0}});
  world.step(50);

  for (std::size_t b = 1; b < world.set().skeleton.bones.size(); ++b) {
    const auto parent = static_cast<std::size_t>(world.set().skeleton.bones[b].parent);
    const Pose made = world.shown(parent).world_from_bone * world.shown(b).parent_from_bone;

    EXPECT_LT((made.position - world.shown(b).world_from_bone.position).norm(), 1e-9);
    EXPECT_LT(test::angle_between(made.rotation, world.shown(b).world_from_bone.rotation), 1e-9);
  }
}

/// How far off the wrist is, rms, over a second in which its markers are hidden but for one that one camera sees.
double wrist_off_m(World& world, bool by_ray, const std::vector<std::string>& hidden, const std::string& seen) {
  for (const std::string& name : hidden) world.show(world.marker(name), false);
  if (by_ray) world.see_by_ray(world.marker(seen), {-3.0, 2.5, 2.5});
  double sum = 0.0;
  for (int i = 0; i < 120; ++i) {
    world.step();
    sum += std::pow(world.off_m(world.bone("LeftHand")), 2);
  }
  return std::sqrt(sum / 120);
}

/// The same without a ray and with one, of somebody who moved before.
void expect_that_a_ray_helps(const std::function<World()>& moved, const std::vector<std::string>& hidden,
                             const std::string& seen) {
  World alone = moved();
  World held = moved();
  const double without = wrist_off_m(alone, false, hidden, seen);
  const double with = wrist_off_m(held, true, hidden, seen);

  EXPECT_GT(without, 0.05);
  EXPECT_LT(with, without / 3.0);
}

TEST(SolveSkeleton, OneCamerasRayHoldsAHiddenHand) {
  const auto moved = [] {
    World world("openmocap18");
    world.step(120);
    return world;
  };
  expect_that_a_ray_helps(moved, {"LeftHand"}, "LeftHand");
}

TEST(SolveSkeleton, OneCamerasRayHoldsAHandWithoutItsWrist) {
  const auto moved = [] {
    World world("baseline41");
    world.step(120);
    return world;
  };
  expect_that_a_ray_helps(moved, {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}, "LHandOut");
}

TEST(SolveSkeleton, OneCamerasRayHoldsAHandThatIsThrownWhenItHides) {
  const auto moved = [] {
    World world("baseline41");
    world.step(110);
    world.pace(12.0);
    return world;
  };
  expect_that_a_ray_helps(moved, {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}, "LHandOut");
}

TEST(SolveSkeleton, AMarkerOnARayIsFilledAndLiesOnIt) {
  World world("openmocap18");
  const std::size_t hand = world.marker("LeftHand");
  const Eigen::Vector3d eye(-3.0, 2.5, 2.5);
  world.step(60);
  world.show(hand, false);
  world.see_by_ray(hand, eye);

  world.step(30);

  const LabelledMarker& label = world.label(hand);
  EXPECT_EQ(label.state, LabelState::Filled);
  EXPECT_EQ(label.cameras, 1U);
  const Eigen::Vector3d direction = (world.true_marker(hand) - eye).normalized();
  EXPECT_LT((label.position.v - eye).cross(direction).norm(), 1e-6);
  EXPECT_LT((label.position.v - world.true_marker(hand)).norm(), 0.03);
  // Known across the ray to some 0.5 mm, along it worse.
  EXPECT_GT(direction.dot(label.covariance_m2 * direction), 4.0 * 1e-4 * 1e-4 * 16.0);
}

TEST(SolveSkeleton, DoesNotFollowARayThatPassesFarFromItsMarker) {
  World world("openmocap18");
  const std::size_t hand = world.marker("LeftHand");
  world.step(60);
  world.show(hand, false);
  // The ray of another place: it is named for the hand, and leads to the right foot.
  world.step(5);
  const double before = world.off_m(world.bone("LeftHand"));
  World other("openmocap18");
  other.step(60);
  other.show(hand, false);
  other.step(4);
  const Eigen::Vector3d eye(-3.0, 2.5, 2.5);
  const Eigen::Vector3d foot = other.true_marker(other.marker("RightFoot"));
  other.see_by_ray(hand, eye + 1e3 * (eye - foot) + 1e3 * (foot - other.true_marker(hand)));
  other.step();

  EXPECT_NEAR(other.off_m(other.bone("LeftHand")), before, 0.01);
}

TEST(SolveSkeleton, NothingJumpsWhenMarkersComeAndGo) {
  World world("baseline41");
  std::mt19937 random(5);
  std::uniform_int_distribution<int> which(0, 40);
  std::vector<int> hidden_for(41, 0);
  std::vector<Eigen::Vector3d> last(18), before(18), true_last(18), true_before(18);
  double most = 0.0, true_most = 0.0, astray = 0.0;

  for (int i = 0; i < 960; ++i) {
    for (std::size_t m = 0; m < 41; ++m) {
      if (hidden_for[m] > 0) --hidden_for[m];
      world.show(m, hidden_for[m] == 0);
    }
    // Twice in a second a whole forearm and hand are hidden for 0.3 s, and a marker every 50 ms for 0.5 s.
    if (i > 120 && i % 6 == 0) hidden_for[static_cast<std::size_t>(which(random))] = 60;
    if (i > 120 && i % 60 == 0) {
      for (const char* name : {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}) hidden_for[world.marker(name)] = 36;
    }
    world.step();
    for (std::size_t b = 0; b < 18; ++b) {
      const Eigen::Vector3d now = world.shown(b).world_from_bone.position, truth = world.true_bone(b).position;
      if (i > 2) most = std::max(most, (now - 2.0 * last[b] + before[b]).norm());
      if (i > 2) true_most = std::max(true_most, (truth - 2.0 * true_last[b] + true_before[b]).norm());
      astray = std::max(astray, world.off_m(b));
      before[b] = last[b];
      last[b] = now;
      true_before[b] = true_last[b];
      true_last[b] = truth;
    }
  }

  EXPECT_GT(astray, 0.05);  // hidden limbs do go astray, so that there is something to come back from
  // A spring of 40 ms moves what is 1 m away by 1 m (dt / 40 ms)^2 in its first set; a fifth for what else there is.
  EXPECT_LT(most, true_most + 1.2 * astray * std::pow(kStep_s / 0.04, 2));
}

TEST(SolveSkeleton, HiddenJointsAreWithin30Mm) {
  World world("baseline41");
  std::mt19937 random(6);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  std::vector<int> hidden_for(41, 0);
  double sum = 0.0;
  int count = 0;

  for (int i = 0; i < 1200; ++i) {
    std::vector<int> seen(18, 0);
    for (std::size_t m = 0; m < 41; ++m) {
      // 30 % of the time hidden, 60 sets each.
      if (hidden_for[m] > 0) --hidden_for[m];
      if (i > 60 && hidden_for[m] == 0 && chance(random) < 0.3 / 0.7 / 60.0) hidden_for[m] = 60;
      world.show(m, hidden_for[m] == 0);
      if (hidden_for[m] == 0) ++seen[static_cast<std::size_t>(world.set().markers[m].bone)];
    }
    world.step();
    for (std::size_t b = 0; b < 18; ++b) {
      if (seen[b] > 0) continue;
      sum += std::pow(world.off_m(b), 2);
      ++count;
    }
  }

  ASSERT_GT(count, 500);
  EXPECT_LT(std::sqrt(sum / count), 0.030);
}

TEST(SolveSkeleton, AHiddenLimbStaysAndDoesNotSnapToRest) {
  World world("openmocap18");
  const std::size_t wrist = world.bone("LeftHand"), elbow = world.bone("LeftLowArm");
  world.step(120);
  world.show(world.marker("LeftHand"), false);
  world.step(24);  // what it was on has died away
  const auto bend = [&] { return body::rotation_vector(world.shown(elbow).parent_from_bone.rotation).norm(); };
  const double after = bend();

  world.step(96);

  EXPECT_LT(world.shown(wrist).confidence, 0.5F);
  EXPECT_NEAR(bend(), after, 0.15);  // of 0.2 to 1.2 rad; rest is 0
}

TEST(SolveSkeleton, ConfidenceFallsWithTheTimeHiddenAndComesBack) {
  World world("openmocap18");
  const std::size_t hand = world.marker("LeftHand"), wrist = world.bone("LeftHand");
  world.step(60);
  const float seen = world.shown(wrist).confidence;
  world.show(hand, false);
  world.step(3);
  const float soon = world.shown(wrist).confidence;
  world.step(40);
  const float late = world.shown(wrist).confidence;
  world.show(hand, true);
  world.step(2);

  EXPECT_GT(seen, soon);
  EXPECT_GT(soon, late);
  EXPECT_LT(late, 0.3F);
  EXPECT_GT(world.shown(wrist).confidence, late + 0.3F);
}

TEST(SolveSkeleton, VelocitiesAreTheSlopesOfTheTruth) {
  World world("baseline41");
  const std::size_t arm = world.bone("LeftLowArm");
  world.step(200);
  std::vector<Pose> truth;
  for (int i = 0; i < 9; ++i) {
    truth.push_back(world.true_bone(arm));
    if (i < 8) world.step();
  }

  // Over about 20 ms: 2.4 sets; the slope in the middle of as many.
  const Eigen::Vector3d velocity = (truth[8].position - truth[3].position) / (5 * kStep_s);
  const Eigen::Vector3d spin = body::rotation_vector(truth[8].rotation * truth[3].rotation.conjugate()) / (5 * kStep_s);
  EXPECT_GT(velocity.norm(), 0.2);
  EXPECT_GT(spin.norm(), 0.5);
  EXPECT_LT((world.shown(arm).velocity_m_s - velocity).norm(), 0.05 * std::max(1.0, velocity.norm()));
  EXPECT_LT((world.shown(arm).spin_rad_s - spin).norm(), 0.15);
}

TEST(SolveSkeleton, SmoothingTellsHowLateItIs) {
  World plain("baseline41"), smooth("baseline41", {.smoothing = {.min_cutoff_hz = 2.0, .beta = 0.0}});
  plain.step(10);
  smooth.step(10);

  EXPECT_EQ(plain.pose().smoothing_delay_s, 0.0);
  EXPECT_NEAR(smooth.pose().smoothing_delay_s, 1.0 / (2.0 * 3.14159265 * 2.0), 1e-6);
}

TEST(SolveSkeleton, StaysFiniteWhateverTheLabelsSay) {
  World world("baseline41");
  world.step(10);
  const double nan = std::nan("");
  world.spoil(3, {nan, nan, nan});
  world.spoil(7, {1e12, 0.0, 0.0});
  world.spoil(9, {INFINITY, 0.0, 0.0});
  world.see_by_ray(5, {nan, 0.0, 0.0});

  world.step(10);

  for (const BonePose& bone : world.pose().bones) {
    EXPECT_TRUE(bone.world_from_bone.position.allFinite());
    EXPECT_NEAR(bone.world_from_bone.rotation.norm(), 1.0, 1e-9);
    EXPECT_TRUE(bone.velocity_m_s.allFinite() && bone.spin_rad_s.allFinite());
    EXPECT_TRUE(std::isfinite(bone.confidence));
  }
}

}  // namespace
}  // namespace mocap::stages
