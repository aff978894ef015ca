#include "lib/join/join.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <iterator>

#include "lib/join/agreement.h"
#include "lib/retrack/part_file.h"
#include "take/take_edit.h"
#include "tools_join/joined_world.h"

namespace mocap::join {
namespace join_test {

using ::testing::HasSubstr;

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class JoinOfChunks : public testing::Test {
 protected:
  Result<JoinReport> join_to(const std::filesystem::path& out, bool resume = false) {
    const JoinOrder order{{take_.chunk(2), take_.chunk(1)}, out, resume};
    return join(order, [&](double share) {
      shares_.push_back(share);
      return shares_.size() != end_at_;
    });
  }

  std::filesystem::path new_file() const {
    const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
    return take_.folder() / (test + ".mcap");
  }

  const ChunkedTake& take_ = ChunkedTake::shared();
  std::vector<double> shares_;
  std::size_t end_at_ = 1000;
};

// The joined take against the take that is tracked as a whole.
TEST_F(JoinOfChunks, HasTheLabelsOfTheWholeTake) {
  const auto report = join_to(new_file());
  ASSERT_TRUE(report) << report.error().message;
  const std::vector<v1::Snapshot> joined = messages_in(new_file()), whole = messages_in(take_.whole());

  ASSERT_EQ(joined.size(), ChunkedTake::kSets);
  EXPECT_EQ(report->sets, ChunkedTake::kSets);
  int differing = 0;
  for (std::size_t i = 0; i < joined.size(); ++i) {
    EXPECT_EQ(joined[i].number(), whole[i].number());
    const Agreement agreement = agreement_of(whole[i], joined[i]);
    EXPECT_TRUE(agreement.holds) << i;
    differing += agreement.differing_labels;
  }
  EXPECT_EQ(differing, 0);
  EXPECT_TRUE(take::verify_take(new_file())->empty());
}

TEST_F(JoinOfChunks, KeepsTheIdsOfTracksAtTheSeam) {
  const auto report = join_to(new_file());
  ASSERT_TRUE(report) << report.error().message;
  const std::vector<v1::Snapshot> joined = messages_in(new_file());
  const auto after = std::ranges::upper_bound(joined, report->seams.at(0).at, {}, [](const v1::Snapshot& set) {
    return from_ns(set.instants().exposed_at_ns());
  });
  ASSERT_TRUE(after != joined.begin() && after != joined.end());

  const auto& ids_before = std::prev(after)->subjects(0).markers().track_ids_plus_one();
  const auto& ids_after = after->subjects(0).markers().track_ids_plus_one();

  ASSERT_EQ(ids_before.size(), ids_after.size());
  int going_on = 0;
  for (int m = 0; m < ids_before.size(); ++m) going_on += ids_before[m] != 0 && ids_before[m] == ids_after[m] ? 1 : 0;
  EXPECT_GE(going_on, ids_before.size() - 2);
}

// Sets that are formed anew are counted from 0 in each chunk.
TEST_F(JoinOfChunks, CountsSetsThatAreFormedAnew) {
  for (const Duration overlap : {ChunkedTake::kOverlap, Duration(std::chrono::milliseconds(1))}) {  // less than a set
    const std::filesystem::path out = take_.folder() / fmt::format("anew_{}.mcap", overlap.count());
    JoinOrder order{{}, out};
    for (const std::uint32_t number : {1U, 2U}) {
      const Chunk chunk{.number = number, .of = 2, .overlap = overlap};
      ChunkedTake::track({.take = take_.recorded(), .out = out, .chunk = chunk, .every_set = true});
      order.chunks.push_back(retrack::chunk_file(out, chunk));
    }

    const auto report = join(order, [](double) { return true; });

    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->seams.at(0).agrees, overlap == ChunkedTake::kOverlap);
    const std::vector<v1::Snapshot> joined = messages_in(out);
    ASSERT_EQ(joined.size(), ChunkedTake::kSets);
    for (std::size_t i = 1; i < joined.size(); ++i) ASSERT_EQ(joined[i].number(), joined[i - 1].number() + 1) << i;
  }
}

TEST_F(JoinOfChunks, GivesTheSameBytesAgain) {
  std::filesystem::create_directories(take_.folder() / "one");
  std::filesystem::create_directories(take_.folder() / "two");

  ASSERT_TRUE(join_to(take_.folder() / "one" / "same.mcap"));
  ASSERT_TRUE(join_to(take_.folder() / "two" / "same.mcap"));

  EXPECT_TRUE(bytes_of(take_.folder() / "one" / "same.mcap") == bytes_of(take_.folder() / "two" / "same.mcap"));
}

TEST_F(JoinOfChunks, ReplacesNothingAndGoesOn) {
  ASSERT_TRUE(join_to(new_file()));
  const std::string before = bytes_of(new_file());

  const auto refused = join_to(new_file()), kept = join_to(new_file(), true);
  const auto without_chunks = join({{}, new_file(), true}, [](double) { return true; });
  const auto with_one_chunk = join({{take_.chunk(2)}, new_file(), true}, [](double) { return true; });
  const auto other = join_to(take_.whole(), true);
  const auto recording = join({{}, take_.recorded(), true}, [](double) { return true; });

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("exists"));
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_TRUE(kept->kept);
  ASSERT_TRUE(without_chunks) << without_chunks.error().message;
  EXPECT_TRUE(without_chunks->kept) << "the chunks are removed once they are joined";
  ASSERT_TRUE(with_one_chunk) << "the other chunk is removed already: " << with_one_chunk.error().message;
  EXPECT_TRUE(with_one_chunk->kept);
  ASSERT_FALSE(recording);
  EXPECT_THAT(recording.error().message, HasSubstr("is no joined take"));
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("was made of another take"));
  EXPECT_EQ(bytes_of(new_file()), before);
}

TEST_F(JoinOfChunks, CanBeEndedBeforeTheFirstSet) {
  end_at_ = 1;

  const auto ended = join_to(new_file());

  ASSERT_FALSE(ended);
  EXPECT_EQ(ended.error().code, ErrorCode::EndOfStream);
  EXPECT_EQ(shares_, std::vector{0.0});
}

TEST_F(JoinOfChunks, LeavesNothingIfItIsEnded) {
  end_at_ = 2;

  const auto ended = join_to(new_file());

  ASSERT_FALSE(ended);
  EXPECT_EQ(ended.error().code, ErrorCode::EndOfStream);
  EXPECT_GT(shares_.back(), shares_.front());
  EXPECT_FALSE(std::filesystem::exists(new_file()));
  EXPECT_FALSE(std::filesystem::exists(retrack::part_of(new_file())));
}

}  // namespace join_test
}  // namespace mocap::join
