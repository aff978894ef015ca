#include "take/snapshot_writer.h"

#include <gmock/gmock.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "wire/decode.h"
#include "wire/json.h"
#include "wire/random_model.h"

namespace mocap::take {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using wire::testing::RandomModel;

class SnapshotWriterTest : public ::testing::Test {
 protected:
  SnapshotWriterTest()
      : folder_(fs::temp_directory_path() / (std::string("mocap_record_") + std::to_string(::getpid()) +
                                             ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::create_directories(folder_);
  }
  ~SnapshotWriterTest() override { fs::remove_all(folder_); }

  static void record(const fs::path& path, std::uint32_t seed, int count) {
    auto writer = make_snapshot_writer(path);
    ASSERT_TRUE(writer) << writer.error().message;
    RandomModel random(seed);
    for (int i = 0; i < count; ++i) ASSERT_TRUE((*writer)->write(random.snapshot(20)));
    ASSERT_TRUE((*writer)->finish());
  }
  static std::string bytes_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  fs::path folder_;
};

TEST_F(SnapshotWriterTest, GivesTheSameBytesForTheSameSnapshots) {
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
    EXPECT_EQ(line, wire::to_json_line(random.snapshot(20)));
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

TEST_F(SnapshotWriterTest, SaysThatTheDiskIsFull) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this machine has no /dev/full";
  fs::create_symlink("/dev/full", folder_ / "full.jsonl");
  auto writer = make_snapshot_writer(folder_ / "full.jsonl");
  ASSERT_TRUE(writer);
  RandomModel random(4);

  ASSERT_TRUE((*writer)->write(random.snapshot(2)));
  const Status finished = (*writer)->finish();

  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().code, ErrorCode::Io);
  EXPECT_THAT(finished.error().message, HasSubstr("full.jsonl' cannot be written: No space left on device"));
  EXPECT_FALSE((*writer)->write(random.snapshot(2)));
}

TEST_F(SnapshotWriterTest, RefusesWhatItCannotWrite) {
  EXPECT_EQ(make_snapshot_writer(folder_ / "take.txt").error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(make_snapshot_writer(folder_ / "no" / "such" / "take.pb").error().code, ErrorCode::Io);
}

TEST_F(SnapshotWriterTest, WritesNothingAfterItsEnd) {
  auto writer = make_snapshot_writer(folder_ / "take.jsonl");
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->finish());

  EXPECT_FALSE((*writer)->write(Snapshot{}));
  EXPECT_EQ(fs::file_size(folder_ / "take.jsonl"), 0U);
}

}  // namespace
}  // namespace mocap::take
