#include "lib/retrack/part_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <unistd.h>

#include <fstream>

#include "support/temporary_folder.h"

namespace mocap::retrack {
namespace part_file_test {

using ::testing::HasSubstr;

class PartFileOf : public testing::Test {
 protected:
  static void write(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }
  static bool exists(const std::filesystem::path& path) { return std::filesystem::exists(path); }

  support::TemporaryFolder folder_;
  std::filesystem::path whole_ = folder_.path() / "walk.mcap";
};

TEST_F(PartFileOf, GetsItsNameWhenItIsWhole) {
  auto part = PartFile::begin(whole_);
  ASSERT_TRUE(part);
  write(part->path(), "text");
  EXPECT_FALSE(exists(whole_));

  const auto published = part->publish();

  ASSERT_TRUE(published) << published.error().message;
  EXPECT_EQ(*published, whole_);
  EXPECT_TRUE(exists(whole_));
  EXPECT_FALSE(exists(part_of(whole_)));
}

TEST_F(PartFileOf, IsRemovedIfItWasNotPublished) {
  {
    auto part = PartFile::begin(whole_);
    ASSERT_TRUE(part);
    write(part->path(), "text");
  }

  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(PartFileOf, ReplacesWhatAKilledProcessLeft) {
  write(part_of(whole_), "half");

  const auto part = PartFile::begin(whole_);

  EXPECT_TRUE(part);
  EXPECT_FALSE(exists(part_of(whole_)));
}

TEST_F(PartFileOf, IsLeftToTheProcessThatWritesIt) {
  write(part_of(whole_), "half");
  const int other = ::open(part_of(whole_).c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(::flock(other, LOCK_EX), 0);

  const auto refused = PartFile::begin(whole_);
  ::close(other);

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Busy);
  EXPECT_THAT(refused.error().message, HasSubstr("walk.mcap' is being written by another process"));
  EXPECT_TRUE(exists(part_of(whole_)));
}

TEST_F(PartFileOf, NeverReplacesAFile) {
  auto part = PartFile::begin(whole_);
  ASSERT_TRUE(part);
  write(part->path(), "new");
  write(whole_, "mine");

  const auto refused = part->publish();

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("is kept"));
  EXPECT_EQ(std::filesystem::file_size(whole_), 4U);
}

}  // namespace part_file_test
}  // namespace mocap::retrack
