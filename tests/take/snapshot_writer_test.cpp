#include "take/recordings/snapshot_writer.h"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "support/file_size_limit.h"
#include "wire/codec/decode.h"
#include "wire/codec/encode.h"
#include "wire/codec/json.h"
#include "wire/random_model.h"
#include "wire/sample_description.h"

namespace mocap::take {
namespace snapshot_writer_test {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using wire::testing::RandomModel;
using wire::testing::sample_description;

// Snapshots with this version, and the fits that lead to it.
Snapshot snapshot_of(std::uint32_t version) {
  Snapshot snapshot;
  snapshot.description_version = version;
  return snapshot;
}

SubjectFit fit_of(std::uint32_t version, double chest_m) {
  SubjectFit fit;
  fit.subject = SubjectId{0};
  fit.description_version = version;
  for (const double z : {0.95, chest_m}) fit.rest_offsets_m.push_back({0.0, 0.0, z});
  for (int i = 0; i < 2; ++i) fit.marker_offsets_m.push_back({0.0, 0.125, 0.0});
  return fit;
}

class SnapshotWriterTest : public ::testing::Test {
 protected:
  SnapshotWriterTest()
      : folder_(fs::temp_directory_path() / (std::string("mocap_record_") + std::to_string(::getpid()) +
                                             ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::create_directories(folder_);
  }
  ~SnapshotWriterTest() override { fs::remove_all(folder_); }

  static void record(const fs::path& path, std::uint32_t seed, int count) {
    auto writer = make_snapshot_writer(path, sample_description());
    ASSERT_TRUE(writer) << writer.error().message;
    RandomModel random(seed);
    for (int i = 0; i < count; ++i) ASSERT_TRUE((*writer)->write(random.snapshot(20)));
    ASSERT_TRUE((*writer)->finish());
  }
  static std::string bytes_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  // Reads every record; expects that the last one is whole.
  static std::uint64_t count_records(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::uint64_t count = 0;
    if (path.extension() == ".jsonl") {
      for (std::string line; std::getline(in, line); ++count) {
        EXPECT_FALSE(in.eof()) << "the last line lacks its newline";
        EXPECT_TRUE(wire::from_json_line(line));
      }
      return count;
    }
    google::protobuf::io::IstreamInputStream stream(&in);
    v1::Snapshot message;
    bool at_end = false;
    for (; google::protobuf::util::ParseDelimitedFromZeroCopyStream(&message, &stream, &at_end); ++count) {
      EXPECT_TRUE(wire::decode(message));
      message.Clear();
    }
    EXPECT_TRUE(at_end);
    return count;
  }

  fs::path folder_;
};

TEST_F(SnapshotWriterTest, WritesEqualBytesForEqualSnapshots) {
  for (const char* ending : {".jsonl", ".pb"}) {
    record(folder_ / (std::string("a") + ending), 1, 100);
    record(folder_ / (std::string("b") + ending), 1, 100);

    const std::string bytes = bytes_of(folder_ / (std::string("a") + ending));
    EXPECT_GT(bytes.size(), 100U * 1024U);
    EXPECT_TRUE(bytes == bytes_of(folder_ / (std::string("b") + ending)));
  }
}

TEST_F(SnapshotWriterTest, WritesLinesThatCanBeReadBack) {
  record(folder_ / "take.jsonl", 2, 50);

  RandomModel random(2);
  std::ifstream in(folder_ / "take.jsonl");
  std::string line;
  int lines = 0;
  for (; std::getline(in, line); ++lines) {
    v1::Snapshot message;
    wire::encode(random.snapshot(20), message);
    if (lines == 0) *message.mutable_description() = wire::encode(sample_description());
    EXPECT_EQ(line, wire::to_json_line(message));
    EXPECT_TRUE(wire::from_json_line(line));
  }
  EXPECT_EQ(lines, 50);
}

TEST_F(SnapshotWriterTest, WritesMessagesThatProtobufReadsBack) {
  record(folder_ / "take.pb", 3, 50);

  RandomModel random(3);
  std::ifstream in(folder_ / "take.pb", std::ios::binary);
  google::protobuf::io::IstreamInputStream stream(&in);
  int count = 0;
  bool at_end = false;
  v1::Snapshot message;
  while (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&message, &stream, &at_end)) {
    EXPECT_EQ(message.number(), random.snapshot(20).number);
    EXPECT_TRUE(wire::decode(message));
    message.Clear();
    ++count;
  }
  EXPECT_TRUE(at_end);
  EXPECT_EQ(count, 50);
}

TEST_F(SnapshotWriterTest, DescribesTheFirstSnapshotAndTheFirstAfterEachFit) {
  auto writer = make_snapshot_writer(folder_ / "take.jsonl", sample_description(1));
  ASSERT_TRUE(writer);
  for (const std::uint32_t version : {1U, 1U}) ASSERT_TRUE((*writer)->write(snapshot_of(version)));
  ASSERT_TRUE((*writer)->learn(fit_of(2, 0.3)));
  ASSERT_TRUE((*writer)->learn(fit_of(3, 0.4)));
  for (const std::uint32_t version : {1U, 2U, 2U, 3U, 3U}) ASSERT_TRUE((*writer)->write(snapshot_of(version)));
  ASSERT_TRUE((*writer)->finish());

  std::vector<std::string> described;
  std::ifstream in(folder_ / "take.jsonl");
  for (std::string line; std::getline(in, line);) {
    const auto message = wire::message_from_json_line(line);
    ASSERT_TRUE(message);
    described.emplace_back("-");
    if (!message->has_description()) continue;
    const auto description = wire::decode(message->description());
    ASSERT_TRUE(description) << description.error().message;
    EXPECT_EQ(description->version, message->description_version());
    EXPECT_EQ(description->subjects[0].marker_set.markers[1].name, "ChestMarker");
    described.back() = fmt::format("{:.2f}", description->subjects[0].marker_set.skeleton.bones[1].rest_offset_m.z());
  }
  EXPECT_THAT(described, ElementsAre("0.25", "-", "-", "0.30", "-", "0.40", "-"));
}

// The readers of streams accept an incomplete last line only, so that the end of this file must be whole.
TEST_F(SnapshotWriterTest, LeavesAReadableFileOnAFullDisk) {
  for (const char* name : {"take.jsonl", "take.pb"}) {
    auto writer = make_snapshot_writer(folder_ / name, sample_description());
    ASSERT_TRUE(writer);
    RandomModel random(5);
    Status written;
    {
      const support::FileSizeLimit full_disk(100'000);
      for (int i = 0; i < 2000 && written; ++i) written = (*writer)->write(random.snapshot(20));
    }

    ASSERT_FALSE(written) << name;
    EXPECT_LE(fs::file_size(folder_ / name), 100'000U);
    EXPECT_EQ(fs::file_size(folder_ / name), (*writer)->size().bytes);
    EXPECT_GT((*writer)->size().records, 10U);
    EXPECT_EQ(count_records(folder_ / name), (*writer)->size().records);
  }
}

TEST_F(SnapshotWriterTest, ReportsAFullDisk) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this machine has no /dev/full";
  fs::create_symlink("/dev/full", folder_ / "full.jsonl");
  auto writer = make_snapshot_writer(folder_ / "full.jsonl", sample_description());
  ASSERT_TRUE(writer);
  RandomModel random(4);

  ASSERT_TRUE((*writer)->write(random.snapshot(2)));
  const Status finished = (*writer)->finish();

  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().code, ErrorCode::Io);
  EXPECT_THAT(finished.error().message, HasSubstr("full.jsonl' cannot be written: No space left on device"));
  EXPECT_FALSE((*writer)->write(random.snapshot(2)));
}

TEST_F(SnapshotWriterTest, RejectsFilesThatItCannotWrite) {
  EXPECT_EQ(make_snapshot_writer(folder_ / "take.txt", sample_description()).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(make_snapshot_writer(folder_ / "no" / "such" / "take.pb", sample_description()).error().code,
            ErrorCode::Io);
}

TEST_F(SnapshotWriterTest, WritesNothingAfterClose) {
  auto writer = make_snapshot_writer(folder_ / "take.jsonl", sample_description());
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->finish());

  EXPECT_FALSE((*writer)->write(Snapshot{}));
  EXPECT_EQ(fs::file_size(folder_ / "take.jsonl"), 0U);
}

}  // namespace snapshot_writer_test
}  // namespace mocap::take
