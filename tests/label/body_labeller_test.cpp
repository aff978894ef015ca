#include "label/body_labeller.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "kinematics/pose_fit.h"
#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::label {
namespace {

constexpr double kStep_s = 1.0 / 60.0;
constexpr int kStill = 60;  // sets in T-pose

// One person whose markers are tracked one track each, as good or as badly as a test wants.
class World {
 public:
  explicit World(const std::string& name, bool fitted = false)
      : set_(test::person(name)),
        truth_(set_, kinematics::PoseFit::Lengths::Fixed),
        labeller_(make_labeller({}, {{"actor", set_, fitted}})) {
    for (std::size_t m = 0; m < set_.markers.size(); ++m) {
      tracks_.push_back({});
      tracks_[m].id = TrackId{next_id_++};
    }
  }

  std::size_t marker(const std::string& name) const {
    std::size_t m = 0;
    while (set_.markers[m].name != name) ++m;
    return m;
  }
  Eigen::Vector3d true_place(std::size_t m) const { return truth_.marker_at(m); }
  const SubjectLabels& labels() const { return *labels_; }
  bool right(std::size_t m) const { return measured(m) && off_m(m) < 0.02; }
  bool wrong(std::size_t m) const { return measured(m) && off_m(m) >= 0.02; }
  int wrongs() const {
    int count = 0;
    for (std::size_t m = 0; m < set_.markers.size(); ++m) count += wrong(m) ? 1 : 0;
    return count;
  }

  void exchange(std::size_t a, std::size_t b) { std::swap(tracks_[a].id, tracks_[b].id); }
  void shift(std::size_t m, const Eigen::Vector3d& by) { tracks_[m].off = by; }
  void hide(std::size_t m) { tracks_[m].hidden = true; }
  void hide_all() {
    for (std::size_t m = 0; m < tracks_.size(); ++m) hide(m);
  }
  void bring_all_back() {
    for (std::size_t m = 0; m < tracks_.size(); ++m) bring_back(m);
  }
  int rights() const {
    int count = 0;
    for (std::size_t m = 0; m < set_.markers.size(); ++m) count += right(m) ? 1 : 0;
    return count;
  }
  Labeller& labeller() { return *labeller_; }
  // Lets time pass that nobody sees.
  void skip(int sets) { sets_ += sets; }

  // A new track, for the old one ended meanwhile.
  void bring_back(std::size_t m) { tracks_[m] = {TrackId{next_id_++}, false, Eigen::Vector3d::Zero()}; }

  void step(int sets = 1) {
    for (int i = 0; i < sets; ++i) step_once();
  }

 private:
  struct Track {
    TrackId id;
    bool hidden = false;
    Eigen::Vector3d off = Eigen::Vector3d::Zero();
  };

  bool measured(std::size_t m) const { return labels().markers[m].state == LabelState::Measured; }
  double off_m(std::size_t m) const { return (labels().markers[m].position.v - true_place(m)).norm(); }

  void step_once() {
    const double t_s = std::max(0, sets_ - kStill) * kStep_s;
    std::vector<Pose> locals;
    for (const Bone& bone : set_.skeleton.bones) {
      Pose pose{bone.rest_offset_m, Eigen::Quaterniond::Identity()};
      const double down = 1.1 * std::min(1.0, t_s);
      const double swing = 0.4 * std::sin(4.0 * t_s);
      if (bone.parent < 0) pose.position = {0.4 * std::sin(t_s), 0.0, 1.0};
      if (bone.name == "LeftUpArm") pose.rotation = kinematics::from_rotation_vector({-down, 0.0, swing});
      if (bone.name == "RightUpArm") pose.rotation = kinematics::from_rotation_vector({down, 0.0, swing});
      if (bone.name == "LeftUpLeg") pose.rotation = kinematics::from_rotation_vector({0.0, swing, 0.0});
      if (bone.name == "RightUpLeg") pose.rotation = kinematics::from_rotation_vector({0.0, -swing, 0.0});
      locals.push_back(pose);
    }
    truth_.set_locals(locals);
    TrackedMarkers tracked;
    for (std::size_t m = 0; m < tracks_.size(); ++m) {
      if (tracks_[m].hidden) continue;
      TrackedMarker track;
      track.id = tracks_[m].id;
      track.state = TrackState::Confirmed;
      track.position.v = truth_.marker_at(m) + tracks_[m].off;
      for (int axis = 0; axis < 3; ++axis) track.position.v[axis] += noise_(random_);
      track.covariance_m2 = 1e-6 * Eigen::Matrix3d::Identity();
      track.cameras = 4;
      track.age_sets = 10;
      tracked.push_back(track);
    }
    Expected expected;
    expected.at = from_ns(1'000'000'000) + from_s(sets_++ * kStep_s);
    labels_ = &labeller_->label(tracked, expected)[0];
  }

  MarkerSet set_;
  kinematics::PoseFit truth_;
  std::unique_ptr<Labeller> labeller_;
  std::vector<Track> tracks_;
  const SubjectLabels* labels_ = nullptr;
  std::uint32_t next_id_ = 100;
  int sets_ = 0;
  std::mt19937 random_{7};
  std::normal_distribution<double> noise_{0.0, 0.0005};
};

TEST(LabelMarkers, NamesATPoseAndKeepsAllNamesInMotion) {
  for (const char* name : {"openmocap18", "baseline41"}) {
    World world(name);
    world.step(kStill);
    ASSERT_EQ(world.labels().phase, SubjectPhase::Tracking) << name;

    for (int i = 0; i < 240; ++i) {
      world.step();
      for (std::size_t m = 0; m < world.labels().markers.size(); ++m) EXPECT_TRUE(world.right(m)) << name << m;
    }
  }
}

TEST(LabelMarkers, MendsTwoTracksThatExchangeTheirMarkersAtOnce) {
  struct Case {
    const char *set, *a, *b;
  };
  for (const Case& one : {Case{"openmocap18", "LeftCollar", "RightCollar"}, Case{"openmocap18", "Neck", "LeftCollar"},
                          Case{"openmocap18", "LeftUpLeg", "RightUpLeg"}, Case{"baseline41", "LWristIn", "LWristOut"},
                          Case{"baseline41", "RToeTip", "RToeOut"}, Case{"baseline41", "LHeel", "LAnkleOut"}}) {
    World world(one.set);
    world.step(kStill + 90);
    const std::size_t a = world.marker(one.a);
    const std::size_t b = world.marker(one.b);

    world.exchange(a, b);

    for (int i = 0; i < 30; ++i) {
      world.step();
      EXPECT_EQ(world.wrongs(), 0) << one.a << " set " << i;
    }
    EXPECT_TRUE(world.right(a) && world.right(b)) << one.a;
  }
}

TEST(LabelMarkers, TakesTheNameBackFromATrackThatLeavesTheBody) {
  World world("openmocap18");
  world.step(kStill + 90);
  const std::size_t foot = world.marker("LeftFoot");

  world.shift(foot, {0.0, 0.15, 0.0});
  world.step();

  EXPECT_EQ(world.wrongs(), 0);
}

TEST(LabelMarkers, GivesALostNameBackWithinFiveSetsOfItsMarkerBeingSeen) {
  for (const char* name : {"LeftCollar", "RightUpArm", "LeftHand", "RightFoot", "LeftLowLeg"}) {
    World world("openmocap18");
    world.step(kStill + 90);
    const std::size_t m = world.marker(name);
    world.hide(m);
    world.step(24);

    world.bring_back(m);
    for (int i = 0; i < 5; ++i) {
      world.step();
      EXPECT_EQ(world.wrongs(), 0) << name;
    }

    EXPECT_TRUE(world.right(m)) << name;
  }
}

TEST(LabelMarkers, ReadsBothWristMarkersRightAfterBothWereHidden) {
  World world("baseline41");
  world.step(kStill + 90);
  const std::size_t in = world.marker("LWristIn");
  const std::size_t out = world.marker("LWristOut");
  world.hide(in);
  world.hide(out);
  world.step(20);

  world.bring_back(out);
  world.step(4);
  world.bring_back(in);
  world.step(10);

  EXPECT_EQ(world.wrongs(), 0);
  EXPECT_TRUE(world.right(in) && world.right(out));
}

TEST(LabelMarkers, NamesABodyWhoseMeasuresAreKnownInMidMotion) {
  for (const char* name : {"openmocap18", "baseline41"}) {
    World world(name, true);
    world.skip(kStill + 100);

    for (int i = 0; i < 30; ++i) {
      world.step();
      EXPECT_EQ(world.wrongs(), 0) << name << i;
    }

    EXPECT_EQ(world.labels().phase, SubjectPhase::Tracking) << name;
    // Some limbs may wait until their motion tells.
    EXPECT_GE(world.rights(), static_cast<int>(world.labels().markers.size()) * 3 / 4) << name;
  }
}

TEST(LabelMarkers, NamesABodyAgainWithinHalfASecondOfABlackout) {
  for (const char* name : {"openmocap18", "baseline41"}) {
    World world(name);
    world.step(kStill + 70);
    world.hide_all();
    world.step(60);

    world.bring_all_back();
    for (int i = 0; i < 30; ++i) {
      world.step();
      EXPECT_EQ(world.wrongs(), 0) << name << i;
    }

    EXPECT_GE(world.rights(), static_cast<int>(world.labels().markers.size()) * 9 / 10) << name;
  }
}

TEST(LabelMarkers, WaitsForATPoseAfterAReset) {
  World world("baseline41");
  world.step(kStill + 70);
  ASSERT_EQ(world.labels().phase, SubjectPhase::Tracking);

  world.labeller().reset(SubjectId{0});
  world.step(60);

  EXPECT_EQ(world.labels().phase, SubjectPhase::Searching);
  EXPECT_EQ(world.rights(), 0);
}

TEST(LabelMarkers, GivesNoNamesToASubjectThatIsAway) {
  World world("baseline41");
  world.step(kStill + 70);

  world.labeller().set_away(SubjectId{0}, true);
  world.step(60);
  EXPECT_EQ(world.rights() + world.wrongs(), 0);

  world.labeller().set_away(SubjectId{0}, false);
  world.step(30);
  EXPECT_EQ(world.labels().phase, SubjectPhase::Tracking);
}

}  // namespace
}  // namespace mocap::label
