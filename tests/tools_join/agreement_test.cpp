#include "lib/join/agreement.h"

#include <gtest/gtest.h>

#include "tools_join/example_states.h"

namespace mocap::join {
namespace agreement_test {

Agreement between(const v1::SubjectState& one, const v1::SubjectState& other) {
  return agreement_of(snapshot_with({one}), snapshot_with({other}));
}

void move_marker(v1::SubjectState& subject, int marker, float by_m) {
  (*subject.mutable_markers()->mutable_positions_m())[3 * marker] += by_m;
}

TEST(AgreementOf, HoldsForTheSameState) {
  const Agreement same = between(tracked_subject(5), tracked_subject(5));

  EXPECT_TRUE(same.holds);
  EXPECT_EQ(same.differing_labels, 0);
}

TEST(AgreementOf, ToleratesOneOfFiveLabelsElsewhere) {
  v1::SubjectState one_elsewhere = tracked_subject(5), near = tracked_subject(5), two_elsewhere = tracked_subject(5);
  move_marker(one_elsewhere, 2, 0.011F);
  move_marker(near, 2, 0.009F);
  for (const int marker : {1, 2}) move_marker(two_elsewhere, marker, 0.5F);

  EXPECT_TRUE(between(tracked_subject(5), one_elsewhere).holds);
  EXPECT_EQ(between(tracked_subject(5), one_elsewhere).differing_labels, 1);
  EXPECT_EQ(between(tracked_subject(5), near).differing_labels, 0);
  EXPECT_FALSE(between(tracked_subject(5), two_elsewhere).holds);
}

TEST(AgreementOf, CountsLabelsThatOneAloneMeasured) {
  v1::SubjectState fewer = tracked_subject(6);
  fewer.mutable_markers()->set_states(5, v1::MARKER_STATE_FILLED);

  EXPECT_TRUE(between(tracked_subject(6), fewer).holds);
  EXPECT_EQ(between(tracked_subject(6), fewer).differing_labels, 1);
  EXPECT_EQ(between(fewer, tracked_subject(6)).differing_labels, 1);
}

TEST(AgreementOf, NeedsFourCommonLabels) {
  EXPECT_TRUE(between(tracked_subject(4), tracked_subject(4)).holds);
  EXPECT_FALSE(between(tracked_subject(3), tracked_subject(3)).holds);
}

TEST(AgreementOf, NeedsTheJointsAtTheSamePlace) {
  EXPECT_TRUE(between(tracked_subject(5), tracked_subject(5, 0.029)).holds);
  EXPECT_FALSE(between(tracked_subject(5), tracked_subject(5, 0.031)).holds);
  v1::SubjectState lost = tracked_subject(5, 0.5);
  lost.mutable_bones()->set_states(0, v1::BONE_STATE_LOST);
  EXPECT_TRUE(between(tracked_subject(5), lost).holds);
}

TEST(AgreementOf, NeedsTheSameSubjects) {
  const v1::SubjectState nobody;

  EXPECT_TRUE(between(nobody, nobody).holds);
  EXPECT_FALSE(between(tracked_subject(5), nobody).holds);
  EXPECT_FALSE(between(nobody, tracked_subject(5)).holds);
  EXPECT_FALSE(agreement_of(snapshot_with({tracked_subject(5)}), {}).holds);
}

TEST(AgreementOf, ReadsColumnsOfTheWrongLength) {
  v1::SubjectState damaged = tracked_subject(5);
  damaged.mutable_markers()->mutable_positions_m()->Truncate(7);
  damaged.mutable_bones()->mutable_world_positions_m()->Truncate(1);

  EXPECT_FALSE(between(tracked_subject(5), damaged).holds);
}

}  // namespace agreement_test
}  // namespace mocap::join
