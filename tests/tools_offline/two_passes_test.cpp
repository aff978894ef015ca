#include "lib/offline/two_passes.h"

#include <gtest/gtest.h>

#include "lib/offline/snapshot_record.h"
#include "tools_retrack/recorded_world.h"

namespace mocap::offline {
namespace two_passes_test {

using retrack::RecordedWorld;

TEST(TwoPasses, GiveTheBackwardPassTheFittedBodyAndJoinFromTheEnd) {
  constexpr std::uint64_t kSets = 150;
  const RecordedWorld world;
  auto passes = TwoPasses::create(world.settings(), world.folder());
  ASSERT_TRUE(passes) << passes.error().message;
  ASSERT_FALSE(passes->settings().subject_models[0].fitted);
  std::vector<Snapshot> forward;
  const auto fusion = assemble_fusion(world.settings());
  world.play(kSets, [&](const FrameSet& set) {
    forward.push_back(fusion->step(set));
    ASSERT_TRUE(passes->add(forward.back(), fusion->fit()));
  });

  passes->turn();

  EXPECT_TRUE(passes->settings().subject_models[0].fitted);
  EXPECT_EQ(passes->settings().refine.instants, 0);
  for (std::size_t i = kSets; i-- > 0;) {
    const auto joined = passes->join(forward[i]);
    ASSERT_TRUE(joined) << joined.error().message;
    EXPECT_EQ(joined->number, forward[i].number);
    EXPECT_EQ(joined->instants.exposed_at, forward[i].instants.exposed_at);
  }
}

TEST(TwoPasses, VelocitiesOfTheBackwardPassAreThoseOfForwardTime) {
  const RecordedWorld world;
  auto passes = TwoPasses::create(world.settings(), world.folder());
  ASSERT_TRUE(passes) << passes.error().message;
  const auto fusion = assemble_fusion(world.settings());
  std::vector<Snapshot> snapshots(2);  // forward, backward
  world.play(150, [&](const FrameSet& set) { snapshots[1] = fusion->step(set); });
  ASSERT_EQ(snapshots[1].labels[0].phase, SubjectPhase::Tracking);
  snapshots[0] = snapshots[1];
  snapshots[0].labels[0].phase = SubjectPhase::Searching;
  for (LabelledMarker& marker : snapshots[0].labels[0].markers) marker.state = LabelState::Lost;
  snapshots[0].poses.clear();
  ASSERT_TRUE(passes->add(snapshots[0], fusion->fit()));
  passes->turn();
  snapshots[1].poses[0].bones[0].velocity_m_s = {1.0, 2.0, 3.0};

  const auto joined = passes->join(snapshots[1]);

  ASSERT_TRUE(joined) << joined.error().message;
  ASSERT_EQ(joined->poses.size(), 1U) << "taken over from the backward pass";
  EXPECT_EQ(joined->poses[0].bones[0].velocity_m_s, Eigen::Vector3d(-1.0, -2.0, -3.0));
}

TEST(SnapshotRecord, PartsComeBackInTheirOrder) {
  std::string record;
  put("one", record);
  put("", record);
  put("three", record);

  std::string_view left = record;
  EXPECT_EQ(next_part(left), "one");
  EXPECT_EQ(next_part(left), "");
  EXPECT_EQ(next_part(left), "three");
  EXPECT_TRUE(left.empty());
}

TEST(SnapshotRecord, ASnapshotComesBack) {
  Snapshot snapshot;
  snapshot.number = 7;
  SubjectLabels& subject = snapshot.labels.push_back({});
  subject.subject = SubjectId{0};
  subject.markers.push_back({}).state = LabelState::Measured;

  const auto back = snapshot_of(bytes_of(snapshot));

  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->number, 7U);
  ASSERT_EQ(back->labels.size(), 1U);
  EXPECT_EQ(back->labels[0].markers[0].state, LabelState::Measured);
}

}  // namespace two_passes_test
}  // namespace mocap::offline
