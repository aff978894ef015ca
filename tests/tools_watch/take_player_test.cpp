#include "watch/take_player.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/places.h"
#include "support/shell.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/take_reader.h"
#include "watch/feed_state.h"
#include "wire/zmq_publisher.h"

namespace mocap::watch {
namespace take_player_test {

class TakePlayerOfAnExample : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_NO_FATAL_FAILURE(take::record_example(path(), 40)); }

  std::filesystem::path path() const { return folder_.path() / "walk-3.mcap"; }

  support::TemporaryFolder folder_;
};

TEST_F(TakePlayerOfAnExample, GivesEveryMessageAsAFeedDoes) {
  auto player = TakePlayer::open(path(), PlayPace::AtOnce);
  ASSERT_TRUE(player) << player.error().message;
  std::map<std::string, int> messages;
  FeedState feed;

  auto message = player->next(Duration::zero());
  for (; message; message = player->next(Duration::zero())) {
    ++messages[message->topic];
    static_cast<void>(feed.take(*message, host_now()));
  }

  EXPECT_EQ(message.error().code, ErrorCode::EndOfStream);
  EXPECT_EQ(messages[wire::kSnapshotTopic], 40);
  EXPECT_EQ(messages[wire::kDescriptionTopic], 1);
  EXPECT_EQ(feed.frames(), 40U);
  EXPECT_EQ(feed.lost(), 0U);
  EXPECT_EQ(feed.restarts(), 0U);
  EXPECT_EQ(feed.unreadable(), 0U) << feed.last_fault();
}

TEST_F(TakePlayerOfAnExample, WaitsUntilAMessageIsDue) {
  auto player = TakePlayer::open(path(), PlayPace::Recorded);
  ASSERT_TRUE(player) << player.error().message;
  const Timestamp started = host_now();
  int snapshots = 0;

  for (;;) {
    const auto message = player->next(std::chrono::seconds(20));
    if (!message) break;
    snapshots += message->topic == wire::kSnapshotTopic ? 1 : 0;
  }

  EXPECT_EQ(snapshots, 40);
  EXPECT_GE(host_now() - started, Duration(39 * take::kExamplePeriod_ns));
}

TEST_F(TakePlayerOfAnExample, RemovesTheClockOfMessagesThatAreShownLater) {
  auto player = TakePlayer::open(path(), PlayPace::Recorded);
  ASSERT_TRUE(player) << player.error().message;
  FeedState feed;

  for (int i = 0; i < 2; ++i) static_cast<void>(feed.take(*player->next(std::chrono::seconds(20)), host_now()));

  EXPECT_EQ(feed.frames(), 1U);
  EXPECT_FALSE(feed.age(0.5)) << "the age of recorded data has no meaning";
}

TEST_F(TakePlayerOfAnExample, TheProgramNamesAndCountsADamagedPart) {
  const std::vector<take::mcap::ChunkIndex> chunks = take::TakeReader::open(path())->mcap().summary().chunks;
  ASSERT_GT(chunks.size(), 2U);
  {
    std::fstream file(path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(chunks[1].offset + chunks[1].length / 2));
    file << "damage";
  }
  const auto summary = folder_.path() / "summary.json";

  const std::string said =
      support::output_of(support::quoted(support::program_folder() + "/mocap-watch") + " " + support::quoted(path()) +
                         " --json --summary " + support::quoted(summary) + " 2>&1 >/dev/null");

  EXPECT_THAT(said, ::testing::HasSubstr("mocap-watch: passed over 1 unreadable part"));
  EXPECT_THAT(said, ::testing::HasSubstr("walk-3.mcap"));
  std::ifstream in(summary);
  EXPECT_EQ(nlohmann::json::parse(in).at("unreadable"), 1);
}

TEST(TakePlayer, FailsWithoutItsFile) {
  EXPECT_EQ(TakePlayer::open("/nowhere/walk.mcap", PlayPace::AtOnce).error().code, ErrorCode::NotFound);
}

}  // namespace take_player_test
}  // namespace mocap::watch
