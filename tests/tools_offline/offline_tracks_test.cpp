#include "lib/offline/offline_tracks.h"

#include <gtest/gtest.h>

#include "tools_retrack/recorded_world.h"

namespace mocap::offline {
namespace offline_tracks_test {

using retrack::RecordedWorld;

// The daemon fits the body in the first second; the offline passes have labels from the first set on.
TEST(OfflineTracks, HaveLabelsFromTheFirstSetOn) {
  constexpr std::uint64_t kSets = 200;
  const RecordedWorld world;
  auto tracks = OfflineTracks::create(world.settings(), world.folder());
  ASSERT_TRUE(tracks) << tracks.error().message;
  std::uint64_t live = 0;
  const auto fusion = assemble_fusion(world.settings());
  world.play(kSets, [&](const FrameSet& set) {
    live += fusion->step(set).labels[0].phase == SubjectPhase::Tracking ? 1 : 0;
    ASSERT_TRUE((*tracks)->add(set));
  });
  double share = 0.0;

  const Status finished = (*tracks)->finish([&](double done) {
    share = done;
    return true;
  });

  ASSERT_TRUE(finished) << finished.error().message;
  EXPECT_GT(share, 0.9);
  ASSERT_EQ((*tracks)->size(), kSets);
  ASSERT_LT(live, kSets) << "the comparison would mean nothing";
  for (std::size_t i = 0; i < kSets; ++i) {
    const auto snapshot = (*tracks)->snapshot(i);
    ASSERT_TRUE(snapshot) << snapshot.error().message;
    EXPECT_EQ(snapshot->number, i);
    ASSERT_EQ(snapshot->labels[0].phase, SubjectPhase::Tracking) << "set " << i;
    ASSERT_FALSE(snapshot->poses[0].bones.empty()) << "set " << i;
  }
}

}  // namespace offline_tracks_test
}  // namespace mocap::offline
