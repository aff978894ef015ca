#include "take/recordings/snapshot_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/recordings/snapshot_writer.h"
#include "take/take_edit.h"
#include "take/take_reader.h"
#include "take/take_writer.h"
#include "wire/random_model.h"
#include "wire/sample_description.h"

namespace mocap::take {
namespace snapshot_reader_test {

using ::testing::HasSubstr;
using wire::testing::RandomModel;
using wire::testing::sample_description;

class SnapshotReaderTest : public ::testing::TestWithParam<const char*> {
 protected:
  std::filesystem::path path() const { return folder_.path() / (std::string("take") + GetParam()); }

  void record(int count) {
    auto writer = make_snapshot_writer(path(), sample_description());
    ASSERT_TRUE(writer);
    RandomModel random(1);
    for (int i = 0; i < count; ++i) ASSERT_TRUE((*writer)->write(random.snapshot(20)));
    ASSERT_TRUE((*writer)->finish());
  }

  support::TemporaryFolder folder_;
};

TEST_P(SnapshotReaderTest, ReadsWhatTheWriterWrote) {
  record(30);

  auto reader = open_snapshots(path());

  ASSERT_TRUE(reader) << reader.error().message;
  RandomModel random(1);
  for (int i = 0; i < 30; ++i) {
    const auto next = (*reader)->next();
    ASSERT_TRUE(next) << next.error().message;
    ASSERT_NE(*next, nullptr);
    const Snapshot truth = random.snapshot(20);
    EXPECT_EQ((*next)->snapshot.number, truth.number);
    EXPECT_EQ((*next)->snapshot.instants.exposed_at, truth.instants.exposed_at);
    EXPECT_EQ((*reader)->description().subjects[0].name, "actor");
  }
  EXPECT_EQ(*(*reader)->next(), nullptr);
  EXPECT_DOUBLE_EQ((*reader)->progress(), 1.0);
}

TEST_P(SnapshotReaderTest, EndsBeforeAnIncompleteSnapshot) {
  record(5);
  std::filesystem::resize_file(path(), std::filesystem::file_size(path()) - 10);

  auto reader = open_snapshots(path());

  int count = 0;
  for (auto next = (*reader)->next(); next && *next != nullptr; next = (*reader)->next()) ++count;
  EXPECT_EQ(count, 4);
  EXPECT_TRUE((*reader)->next());
  EXPECT_TRUE((*reader)->faults().cut_off);
}

TEST_P(SnapshotReaderTest, RefusesOtherContent) {
  folder_.write(std::string("take") + GetParam(), std::string(300, '\7') + "\n\n");

  auto reader = open_snapshots(path());

  const auto next = (*reader)->next();
  ASSERT_FALSE(next);
  EXPECT_EQ(next.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(next.error().message, HasSubstr(path().string()));
}

INSTANTIATE_TEST_SUITE_P(Forms, SnapshotReaderTest, ::testing::Values(".pb", ".jsonl"),
                         [](const auto& form) { return std::string(form.param + 1); });

TEST(OpenSnapshots, ReadsATake) {
  const support::TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(record_example(folder.path() / "walk.mcap", 40));

  auto reader = open_snapshots(folder.path() / "walk.mcap");

  ASSERT_TRUE(reader) << reader.error().message;
  for (std::uint64_t set = 0; set < 40; ++set) {
    const auto next = (*reader)->next();
    ASSERT_TRUE(next && *next != nullptr);
    EXPECT_EQ((*next)->snapshot.number, set);
    EXPECT_EQ((*next)->utc_minus_host_ns, 1'700'000'000'000'000'000);
    EXPECT_EQ((*reader)->description().subjects.size(), example_description().subjects.size());
  }
  EXPECT_EQ(*(*reader)->next(), nullptr);
  EXPECT_NEAR((*reader)->progress(), 1.0, 0.1);
}

// Reads all; returns the numbers of the snapshots.
std::vector<std::uint64_t> numbers_in(SnapshotReader& reader) {
  std::vector<std::uint64_t> numbers;
  for (auto next = reader.next(); next && *next != nullptr; next = reader.next()) {
    numbers.push_back((*next)->snapshot.number);
  }
  return numbers;
}

TEST(OpenSnapshots, HasTheMarksOfATake) {
  const support::TemporaryFolder folder;
  auto writer = TakeWriter::create(folder.path() / "walk.mcap", example_start());
  ASSERT_TRUE(writer);
  ASSERT_TRUE(append_example(**writer, 0, 40));
  v1::Event mark, other;
  mark.set_kind(v1::EVENT_KIND_MARK);
  mark.set_message("jump");
  ASSERT_TRUE((*writer)->append(kEventTopic, example_time(3), mark.SerializeAsString()));
  ASSERT_TRUE((*writer)->append(kEventTopic, example_time(5), other.SerializeAsString()));
  ASSERT_TRUE((*writer)->finish(example_end(40)));

  auto reader = open_snapshots(folder.path() / "walk.mcap");

  EXPECT_EQ(numbers_in(**reader).size(), 40U);
  ASSERT_EQ((*reader)->marks().size(), 1U);
  EXPECT_EQ((*reader)->marks()[0].at, example_time(3));
  EXPECT_EQ((*reader)->marks()[0].text, "jump");
  EXPECT_FALSE((*reader)->faults().cut_off);
  EXPECT_EQ((*reader)->faults().damaged_parts, 0U);
}

void damage(const std::filesystem::path& path, const mcap::ChunkIndex& chunk) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(chunk.offset + chunk.length / 2));
  file << "damage";
}

// Damages the chunk that has the description of this number, from 0.
void damage_description(const std::filesystem::path& path, std::size_t number) {
  const mcap::Summary summary = TakeReader::open(path)->mcap().summary();
  const auto channel =
      std::ranges::find_if(summary.channels, [](const auto& one) { return one.second.topic == kDescriptionTopic; });
  ASSERT_NE(channel, summary.channels.end());
  for (const mcap::ChunkIndex& chunk : summary.chunks) {
    if (chunk.message_index_offsets.contains(channel->first) && number-- == 0) return damage(path, chunk);
  }
  FAIL() << "the take has fewer descriptions";
}

// The description changes at sets 100 and 200, to the versions 2 and 3.
void record_changing_descriptions(const std::filesystem::path& path) {
  auto writer = TakeWriter::create(path, example_start(), {.sync = false});
  ASSERT_TRUE(writer) << writer.error().message;
  Description description = example_description();
  for (std::uint64_t set = 0; set < 300; ++set) {
    if (set > 0 && set % 100 == 0) {
      ++description.version;
      ASSERT_TRUE((*writer)->append(description, example_time(set)));
    }
    Snapshot snapshot = example_snapshot(set);
    snapshot.description_version = description.version;
    ASSERT_TRUE((*writer)->append(snapshot));
  }
  ASSERT_TRUE((*writer)->finish(example_end(300)));
}

TEST(OpenSnapshots, LeavesOutTheSnapshotsWhoseDescriptionIsDamaged) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "walk.mcap";
  for (std::size_t damaged = 0; damaged < 3; ++damaged) {
    std::filesystem::remove(path);
    ASSERT_NO_FATAL_FAILURE(record_changing_descriptions(path));
    ASSERT_NO_FATAL_FAILURE(damage_description(path, damaged));

    auto reader = open_snapshots(path);

    ASSERT_TRUE(reader) << reader.error().message;
    std::size_t read = 0;
    for (auto next = (*reader)->next(); next && *next != nullptr; next = (*reader)->next(), ++read) {
      const std::uint64_t version = (*next)->snapshot.number / 100 + 1;
      EXPECT_EQ((*reader)->description().version, version) << (*next)->snapshot.number;
      EXPECT_NE(version, damaged + 1);
    }
    EXPECT_EQ((*reader)->faults().damaged_parts, 1U);
    EXPECT_GT((*reader)->faults().undescribed_snapshots, 0U);
    EXPECT_GT(read, 100U);
  }
}

TEST(OpenSnapshots, LeavesOutTheSnapshotsWhoseDescriptionTheRepairLeftOut) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "walk.mcap";
  ASSERT_NO_FATAL_FAILURE(record_changing_descriptions(path));
  ASSERT_NO_FATAL_FAILURE(damage_description(path, 1));
  ASSERT_TRUE(repair_take(path));

  auto reader = open_snapshots(path);

  ASSERT_TRUE(reader) << reader.error().message;
  for (const std::uint64_t number : numbers_in(**reader)) EXPECT_TRUE(number < 100 || number >= 200) << number;
  EXPECT_GT((*reader)->faults().undescribed_snapshots, 0U);
}

TEST(OpenSnapshots, NamesTheDamageThatLeavesNoDescription) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "walk.mcap";
  ASSERT_NO_FATAL_FAILURE(record_example(path, 60));
  ASSERT_NO_FATAL_FAILURE(damage_description(path, 0));
  const std::uint64_t at = TakeReader::open(path)->mcap().summary().chunks.front().offset;

  auto reader = open_snapshots(path);
  const auto next = (*reader)->next();

  ASSERT_FALSE(next);
  EXPECT_THAT(next.error().message, HasSubstr("byte " + std::to_string(at)));
}

TEST(OpenSnapshots, CountsAnEventThatCannotBeDecoded) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "walk.mcap";
  auto writer = TakeWriter::create(path, example_start(), {.sync = false});
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->append(kEventTopic, example_time(0), "\xFF\xFF"));
  ASSERT_TRUE(append_example(**writer, 0, 40));
  ASSERT_TRUE((*writer)->finish(example_end(40)));

  auto reader = open_snapshots(path);

  EXPECT_EQ(numbers_in(**reader).size(), 40U);
  EXPECT_EQ((*reader)->faults().damaged_parts, 1U);
}

TEST(OpenSnapshots, LeavesOutDamagedChunksAndCountsThem) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "walk.mcap";
  ASSERT_NO_FATAL_FAILURE(record_example(path, 120));
  const std::vector<mcap::ChunkIndex> chunks = TakeReader::open(path)->mcap().summary().chunks;
  ASSERT_GT(chunks.size(), 3U);
  damage(path, chunks[2]);

  auto reader = open_snapshots(path);

  ASSERT_TRUE(reader) << reader.error().message;
  const std::vector<std::uint64_t> numbers = numbers_in(**reader);
  EXPECT_LT(numbers.size(), 120U);
  EXPECT_EQ(numbers.back(), 119U);
  EXPECT_EQ((*reader)->faults().damaged_parts, 1U);
  EXPECT_EQ((*reader)->faults().undescribed_snapshots, 0U);
  EXPECT_FALSE((*reader)->faults().cut_off);
}

TEST(OpenSnapshots, TellsThatATakeWasCutOff) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "walk.mcap";
  ASSERT_NO_FATAL_FAILURE(record_example(path, 120));
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);

  auto reader = open_snapshots(path);

  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_GT(numbers_in(**reader).size(), 10U);
  EXPECT_TRUE((*reader)->faults().cut_off);
  EXPECT_FALSE((*reader)->faults().being_written);
}

TEST(OpenSnapshots, RefusesOtherFiles) {
  EXPECT_EQ(open_snapshots("take.txt").error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(open_snapshots("/no/such/take.pb").error().code, ErrorCode::NotFound);
}

}  // namespace snapshot_reader_test
}  // namespace mocap::take
