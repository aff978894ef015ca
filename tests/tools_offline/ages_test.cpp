#include "lib/offline/ages.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mocap::offline {
namespace ages_test {

Snapshot snapshot_at(double t_s, std::initializer_list<LabelState> states,
                     SubjectPhase phase = SubjectPhase::Tracking) {
  Snapshot snapshot;
  snapshot.instants.exposed_at = from_ns(1'000'000'000) + from_s(t_s);
  SubjectLabels& subject = snapshot.labels.push_back({});
  subject.subject = SubjectId{0};
  subject.phase = phase;
  for (const LabelState state : states) subject.markers.push_back({}).state = state;
  SubjectPose& pose = snapshot.poses.push_back({});
  pose.subject = SubjectId{0};
  pose.bones.push_back({}).state = *states.begin() == LabelState::Measured ? BoneState::Measured : BoneState::Filled;
  return snapshot;
}

TEST(AgeWatch, CountsFromTheLastMeasurement) {
  AgeWatch watch;
  (void)watch.next(snapshot_at(0.0, {LabelState::Measured, LabelState::Filled}));

  const Ages ages = watch.next(snapshot_at(0.5, {LabelState::Filled, LabelState::Measured}));

  EXPECT_FLOAT_EQ(ages.labels[0][0], 0.5F);
  EXPECT_FLOAT_EQ(ages.labels[0][1], 0.0F);
  EXPECT_FLOAT_EQ(ages.bones[0][0], 0.5F);
}

TEST(AgeWatch, ForgetsASubjectThatIsLost) {
  AgeWatch watch;
  (void)watch.next(snapshot_at(0.0, {LabelState::Measured}));
  (void)watch.next(snapshot_at(0.1, {LabelState::Lost}, SubjectPhase::Lost));

  const Ages ages = watch.next(snapshot_at(0.2, {LabelState::Filled}));

  EXPECT_TRUE(std::isinf(ages.labels[0][0]));
}

TEST(Ages, ComeBackFromBytes) {
  AgeWatch watch;
  (void)watch.next(snapshot_at(0.0, {LabelState::Measured, LabelState::Filled}));
  const Snapshot snapshot = snapshot_at(0.5, {LabelState::Filled, LabelState::Filled});
  const Ages ages = watch.next(snapshot);

  const auto back = decode_ages(encode(ages), snapshot);

  ASSERT_TRUE(back);
  EXPECT_EQ(back->labels, ages.labels);
  EXPECT_EQ(back->bones, ages.bones);
  EXPECT_FALSE(decode_ages(encode(ages) + "x", snapshot));
  EXPECT_FALSE(decode_ages("", snapshot));
}

TEST(Ages, GiveTheNearerObservationTheLargerShare) {
  const float never = std::numeric_limits<float>::infinity();
  EXPECT_DOUBLE_EQ(forward_share(0.25F, 0.75F), 0.75);
  EXPECT_DOUBLE_EQ(forward_share(0.5F, never), 1.0);
  EXPECT_DOUBLE_EQ(forward_share(never, 0.5F), 0.0);
  EXPECT_DOUBLE_EQ(forward_share(never, never), 1.0);
}

}  // namespace ages_test
}  // namespace mocap::offline
