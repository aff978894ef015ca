#include "lib/offline/two_way.h"

#include <gtest/gtest.h>

#include <limits>

namespace mocap::offline {
namespace two_way_test {

constexpr std::size_t kMarkers = 6;
constexpr float kNever = std::numeric_limits<float>::infinity();

class TwoWayOfOneSubject : public testing::Test {
 protected:
  TwoWayOfOneSubject() {
    Subject& subject = subjects_.emplace_back();
    subject.marker_set.skeleton.bones.resize(2);
    subject.marker_set.skeleton.bones[1].parent = 0;
    subject.marker_set.skeleton.bones[1].rest_offset_m = {0.3, 0.0, 0.0};
    subject.marker_set.markers.resize(kMarkers);
  }

  // All markers measured, 1 m apart from each other; the arm points along x.
  static Pass tracked(double shift_m = 0.0) {
    Pass pass;
    SubjectLabels& labels = pass.snapshot.labels.push_back({});
    labels.subject = SubjectId{0};
    labels.phase = SubjectPhase::Tracking;
    for (std::size_t m = 0; m < kMarkers; ++m) {
      LabelledMarker& marker = labels.markers.push_back({});
      marker.state = LabelState::Measured;
      marker.position.v = {static_cast<double>(m) + shift_m, 0.0, 1.0};
      marker.cameras = 3;
      marker.track = TrackId{static_cast<std::uint32_t>(70 + m)};
    }
    SubjectPose& pose = pass.snapshot.poses.push_back({});
    pose.subject = SubjectId{0};
    for (const double x_m : {0.0, 0.3}) {
      BonePose& bone = pose.bones.push_back({});
      bone.state = BoneState::Measured;
      bone.world_from_bone.position = {x_m, 0.0, 1.0};
      bone.parent_from_bone = bone.world_from_bone;
    }
    pose.bones[1].parent_from_bone.position = {0.3, 0.0, 0.0};
    pass.ages = {{std::vector<float>(kMarkers, 0.0F)}, {{0.0F, 0.0F}}};
    return pass;
  }

  // The same markers, without labels.
  static Pass searching() {
    Pass pass = tracked();
    pass.snapshot.labels[0].phase = SubjectPhase::Searching;
    for (LabelledMarker& marker : pass.snapshot.labels[0].markers) {
      pass.snapshot.unlabelled.push_back({marker.track, marker.position, 0.1, 3});
      marker = {};
    }
    pass.snapshot.poses.clear();
    pass.ages = {{std::vector<float>(kMarkers, kNever)}, {}};
    return pass;
  }

  static void fill(Pass& pass, std::size_t marker, double y_m, float age_s) {
    LabelledMarker& label = pass.snapshot.labels[0].markers[marker];
    label.state = LabelState::Filled;
    label.cameras = 0;
    label.position.v.y() = y_m;
    pass.ages.labels[0][marker] = age_s;
  }

  std::vector<Subject> subjects_;
};

TEST_F(TwoWayOfOneSubject, StartASubjectBeforeItWasFound) {
  TwoWay both(subjects_);
  (void)both.join(tracked(), tracked());

  const Snapshot joined = both.join(searching(), tracked());

  ASSERT_EQ(joined.labels[0].phase, SubjectPhase::Tracking);
  EXPECT_EQ(joined.labels[0].markers[3].position.v.x(), 3.0);
  EXPECT_EQ(joined.labels[0].markers[3].track, TrackId{73}) << "the track of the forward pass";
  EXPECT_TRUE(joined.unlabelled.empty()) << "each marker is published once";
  EXPECT_EQ(joined.poses.size(), 1U);
}

TEST_F(TwoWayOfOneSubject, DoNotStartASubjectThatTheForwardPassFoundElsewhere) {
  TwoWay both(subjects_);
  (void)both.join(tracked(), tracked(0.5));

  const Snapshot joined = both.join(searching(), tracked(0.5));

  EXPECT_EQ(joined.labels[0].phase, SubjectPhase::Searching);
  EXPECT_EQ(joined.unlabelled.size(), kMarkers);
}

TEST_F(TwoWayOfOneSubject, StartTheOnlySubjectAlsoWhereTheBackwardPassFoundItLater) {
  TwoWay both(subjects_);
  (void)both.join(tracked(), searching());

  EXPECT_EQ(both.join(searching(), tracked()).labels[0].phase, SubjectPhase::Tracking);
}

TEST_F(TwoWayOfOneSubject, DoNotStartOneOfTwoSubjectsThatTheBackwardPassLostInBetween) {
  subjects_.push_back(subjects_.front());
  TwoWay both(subjects_);
  (void)both.join(tracked(), tracked());
  (void)both.join(searching(), searching());

  EXPECT_EQ(both.join(searching(), tracked()).labels[0].phase, SubjectPhase::Searching);
}

TEST_F(TwoWayOfOneSubject, DoNotStartASubjectThatIsOnlyPredicted) {
  TwoWay both(subjects_);
  (void)both.join(tracked(), tracked());
  Pass dark = tracked();
  for (std::size_t m = 0; m < kMarkers; ++m) fill(dark, m, 0.0, 0.2F);

  EXPECT_EQ(both.join(searching(), dark).labels[0].phase, SubjectPhase::Searching);
}

TEST_F(TwoWayOfOneSubject, KeepALabelLostThatNoPassMeasured) {
  TwoWay both(subjects_);
  Pass forward = tracked(), backward = tracked();
  forward.snapshot.labels[0].markers[2] = {};
  fill(backward, 2, 0.0, 0.2F);

  EXPECT_EQ(both.join(forward, backward).labels[0].markers[2].state, LabelState::Lost);
}

TEST_F(TwoWayOfOneSubject, KeepWhatTheForwardPassMeasured) {
  TwoWay both(subjects_);

  const Snapshot joined = both.join(tracked(), tracked(0.004));

  EXPECT_EQ(joined.labels[0].markers[3].position.v.x(), 3.0);
}

TEST_F(TwoWayOfOneSubject, BlendAGapFromBothSides) {
  TwoWay both(subjects_);
  Pass forward = tracked(), backward = tracked();
  fill(forward, 2, 0.4, 0.1F);
  fill(backward, 2, 0.0, 0.3F);

  const Snapshot joined = both.join(forward, backward);

  EXPECT_EQ(joined.labels[0].markers[2].state, LabelState::Filled);
  EXPECT_NEAR(joined.labels[0].markers[2].position.v.y(), 0.3, 1e-6);
}

TEST_F(TwoWayOfOneSubject, TakeALabelThatOnlyTheBackwardPassMeasured) {
  TwoWay both(subjects_);
  Pass forward = tracked();
  fill(forward, 2, 0.4, 0.1F);
  forward.snapshot.unlabelled.push_back({TrackId{5}, WorldPoint{{2.001, 0.0, 1.0}}, 0.1, 3});

  const Snapshot joined = both.join(forward, tracked());

  EXPECT_EQ(joined.labels[0].markers[2].state, LabelState::Measured);
  EXPECT_EQ(joined.labels[0].markers[2].track, TrackId{5});
  EXPECT_TRUE(joined.unlabelled.empty());
}

TEST_F(TwoWayOfOneSubject, BlendABoneAndKeepItsLength) {
  TwoWay both(subjects_);
  Pass forward = tracked(), backward = tracked();
  for (Pass* pass : {&forward, &backward}) {
    pass->snapshot.poses[0].bones[1].state = BoneState::Filled;
    pass->ages.bones[0][1] = 0.2F;
  }
  backward.snapshot.poses[0].bones[1].world_from_bone.rotation = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ());

  const Snapshot joined = both.join(forward, backward);

  const BonePose& arm = joined.poses[0].bones[1];
  EXPECT_NEAR(Eigen::AngleAxisd(arm.world_from_bone.rotation).angle(), 0.2, 1e-6) << "half of both";
  EXPECT_NEAR((arm.world_from_bone.position - joined.poses[0].bones[0].world_from_bone.position).norm(), 0.3, 1e-9);
}

}  // namespace two_way_test
}  // namespace mocap::offline
