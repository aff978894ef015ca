#include "fusion/idle_parts.h"

#include <gtest/gtest.h>

namespace mocap::fusion {
namespace idle_parts_test {

TEST(IdleParts, GiveASnapshotWithViewsAndNothingElse) {
  Fusion fusion(make_idle_parts(), 2);
  BlobFrame first, second;
  first.camera = CameraId{0};
  second.camera = CameraId{1};
  first.blobs.push_back(Blob{});
  FrameSet set;
  set.exposed_at = from_ns(1000);
  set.views.push_back(&first);
  set.views.push_back(&second);

  const Snapshot& snapshot = fusion.step(set);

  EXPECT_EQ(snapshot.views.size(), 2U);
  EXPECT_TRUE(snapshot.labels.empty());
  EXPECT_TRUE(snapshot.poses.empty());
  EXPECT_TRUE(snapshot.unlabelled.empty());
}

TEST(IdleParts, TheSolverPassesLabelsOn) {
  IdleSolver solver;
  Labels labels;
  labels.push_back({}).subject = SubjectId{3};

  const SolvedSubjects& solved = solver.solve(labels, from_ns(0), {}, {});

  ASSERT_EQ(solved.labels.size(), 1U);
  EXPECT_EQ(solved.labels[0].subject, SubjectId{3});
}

}  // namespace idle_parts_test
}  // namespace mocap::fusion
