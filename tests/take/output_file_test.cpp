#include "take/recordings/output_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "support/file_size_limit.h"
#include "support/temporary_folder.h"

namespace mocap::take {
namespace output_file_test {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class OutputFileTest : public ::testing::Test {
 protected:
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  static std::string bytes_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  // Writes one record; returns the path in use.
  std::string write(const std::string& name, const std::string& record) const {
    auto file = OutputFile::create(path(name));
    EXPECT_TRUE(file) << file.error().message;
    EXPECT_TRUE(file->append(record));
    EXPECT_TRUE(file->finish());
    return fs::path(file->path()).filename();
  }

  support::TemporaryFolder folder_;
};

TEST_F(OutputFileTest, KeepsExistingFilesAndTakesTheNextFreeNumber) {
  EXPECT_EQ(write("take.jsonl", "first"), "take.jsonl");
  EXPECT_EQ(write("take.jsonl", "second"), "take-2.jsonl");
  folder_.write("take-3.jsonl", "of the user");
  EXPECT_EQ(write("take.jsonl", "third"), "take-4.jsonl");

  EXPECT_EQ(bytes_of(path("take.jsonl")), "first");
  EXPECT_EQ(bytes_of(path("take-2.jsonl")), "second");
  EXPECT_EQ(bytes_of(path("take-3.jsonl")), "of the user");
  EXPECT_EQ(bytes_of(path("take-4.jsonl")), "third");
}

TEST_F(OutputFileTest, KeepsAFileBehindALink) {
  folder_.write("precious.pb", "first");
  fs::create_symlink(path("precious.pb"), path("take.pb"));
  fs::create_symlink(path("nothing.pb"), path("empty.pb"));

  EXPECT_EQ(write("take.pb", "second"), "take-2.pb");
  EXPECT_EQ(write("empty.pb", "third"), "empty-2.pb");

  EXPECT_EQ(bytes_of(path("precious.pb")), "first");
  EXPECT_FALSE(fs::exists(path("nothing.pb")));
}

TEST_F(OutputFileTest, OpensAPipeAsItIs) {
  ASSERT_EQ(::mkfifo(path("pipe.pb").c_str(), 0600), 0);
  const int reader = ::open(path("pipe.pb").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);

  EXPECT_EQ(write("pipe.pb", "record"), "pipe.pb");

  char read[16] = {};
  EXPECT_EQ(::read(reader, read, sizeof read), 6);
  EXPECT_STREQ(read, "record");
  ::close(reader);
}

TEST_F(OutputFileTest, RejectsAFolder) {
  fs::create_directory(path("folder.pb"));

  const auto file = OutputFile::create(path("folder.pb"));

  ASSERT_FALSE(file);
  EXPECT_THAT(file.error().message, HasSubstr("folder.pb' cannot be opened: Is a directory"));
}

TEST_F(OutputFileTest, SaysWhatToDoIfItsFolderIsMissing) {
  const auto file = OutputFile::create(path("missing/take.pb"));

  ASSERT_FALSE(file);
  EXPECT_THAT(file.error().message, HasSubstr("take.pb' cannot be opened: No such file or directory; make its folder"));
}

TEST_F(OutputFileTest, CountsRecordsAndBytes) {
  auto file = OutputFile::create(path("take.pb"));
  ASSERT_TRUE(file);

  ASSERT_TRUE(file->append_head("head"));
  ASSERT_TRUE(file->append("12"));
  ASSERT_TRUE(file->append_delimited("345"));
  EXPECT_EQ(file->size().records, 2U);
  EXPECT_EQ(file->size().bytes, 10U);
  ASSERT_TRUE(file->finish());

  EXPECT_EQ(file->size().records, 2U);
  EXPECT_EQ(bytes_of(path("take.pb")),
            "head12\x03"
            "345");
}

// The limits end the file within a record of the first piece, within the varint before a record, and in a later piece.
TEST_F(OutputFileTest, EndsWithTheLastWholeRecordOnAFullDisk) {
  const std::string record(999, 'x');  // 1001 bytes with its length
  for (const rlim_t limit : {500U, 1001U, 2002U, 2003U, 30'000U, 200'000U}) {
    const fs::path name = path(std::to_string(limit) + ".pb");
    auto file = OutputFile::create(name);
    ASSERT_TRUE(file);
    Status written;
    {
      const support::FileSizeLimit full_disk(limit);
      for (int i = 0; i < 300 && written; ++i) written = file->append_delimited(record);
    }

    ASSERT_FALSE(written) << limit;
    EXPECT_EQ(written.error().code, ErrorCode::Io);
    EXPECT_EQ(file->size().records, limit / 1001) << limit;
    EXPECT_EQ(file->size().bytes, limit / 1001 * 1001) << limit;
    EXPECT_EQ(fs::file_size(name), limit / 1001 * 1001) << limit;
    EXPECT_EQ(file->append(record).error().message, written.error().message) << "the disk has space again";
    EXPECT_FALSE(file->finish());
    EXPECT_EQ(fs::file_size(name), limit / 1001 * 1001) << limit;
  }
}

TEST_F(OutputFileTest, KeepsNoHeadWithoutARecord) {
  auto file = OutputFile::create(path("take.blobs"));
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->append_head("head"));
  ASSERT_TRUE(file->append(std::string(1000, 'x')));

  const support::FileSizeLimit full_disk(100);
  EXPECT_FALSE(file->finish());

  EXPECT_EQ(fs::file_size(path("take.blobs")), 0U);
  EXPECT_EQ(file->size().bytes, 0U);
}

}  // namespace output_file_test
}  // namespace mocap::take
