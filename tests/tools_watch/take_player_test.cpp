#include "watch/take_player.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "support/places.h"
#include "support/shell.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/take_reader.h"
#include "watch/feed_state.h"
#include "wire/zmq_publisher.h"

namespace mocap::watch {
namespace take_player_test {

using ::testing::HasSubstr;

class TakePlayerOfAnExample : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_NO_FATAL_FAILURE(take::record_example(path(), 40)); }

  std::filesystem::path path() const { return folder_.path() / "walk-3.mcap"; }

  take::mcap::ChunkIndex second_chunk() const { return take::TakeReader::open(path())->mcap().summary().chunks.at(1); }

  void overwrite(std::uint64_t offset, std::string_view bytes) const {
    std::fstream file(path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(offset));
    file << bytes;
  }

  // The errors that the program prints, and the count of its summary.
  std::pair<std::string, int> play() const {
    const auto summary = folder_.path() / "summary.json";
    const std::string said =
        support::output_of(support::quoted(support::program_folder() + "/mocap-watch") + " " + support::quoted(path()) +
                           " --json --summary " + support::quoted(summary) + " 2>&1 >/dev/null");
    std::ifstream in(summary);
    return {said, nlohmann::json::parse(in).at("unreadable").get<int>()};
  }

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
  const take::mcap::ChunkIndex chunk = second_chunk();
  overwrite(chunk.offset + chunk.length / 2, "damage");

  const auto [said, unreadable] = play();

  EXPECT_THAT(said, HasSubstr("mocap-watch: passed over 1 unreadable part"));
  EXPECT_THAT(said, HasSubstr("walk-3.mcap"));
  EXPECT_EQ(unreadable, 1);
}

TEST_F(TakePlayerOfAnExample, TheProgramNamesAndCountsADamagedPartOfATakeWithoutAnIndex) {
  const take::mcap::ChunkIndex chunk = second_chunk();
  overwrite(chunk.offset + chunk.length / 2, "damage");
  std::filesystem::resize_file(path(), std::filesystem::file_size(path()) - 1);

  const auto [said, unreadable] = play();

  EXPECT_THAT(said, HasSubstr("mocap-watch: passed over 1 unreadable part"));
  EXPECT_THAT(said, HasSubstr("walk-3.mcap"));
  EXPECT_THAT(said, HasSubstr("byte " + std::to_string(chunk.offset)));
  EXPECT_EQ(unreadable, 1);
}

TEST_F(TakePlayerOfAnExample, TheProgramNamesAndCountsAPartOfAnUnknownCompression) {
  constexpr std::uint64_t kCompression = 41;  // offset of the name of the compression in the record of a chunk
  overwrite(second_chunk().offset + kCompression, "????");

  const auto [said, unreadable] = play();

  EXPECT_THAT(said, HasSubstr("mocap-watch: passed over 1 unreadable part"));
  EXPECT_THAT(said, HasSubstr("????"));
  EXPECT_EQ(unreadable, 1);
}

TEST(TakePlayer, FailsWithoutItsFile) {
  EXPECT_EQ(TakePlayer::open("/nowhere/walk.mcap", PlayPace::AtOnce).error().code, ErrorCode::NotFound);
}

}  // namespace take_player_test
}  // namespace mocap::watch
