#include "ctl/new_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "support/temporary_folder.h"

namespace mocap::ctl {
namespace new_file_test {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

std::string content_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

bool has_unnamed_files(const fs::path& folder) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
  if (file >= 0) ::close(file);
  return file >= 0;
}

TEST(NewFile, HasItsNameWhenItIsComplete) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.path() / "a.txt";

  auto file = NewFile::create(path);
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(file->append("half"));
  EXPECT_FALSE(fs::exists(path));
  ASSERT_TRUE(file->finish());

  EXPECT_EQ(content_of(path), "half");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

// A killed program does not run destructors.
TEST(NewFile, HasNoNameBefore) {
  const support::TemporaryFolder folder;
  if (!has_unnamed_files(folder.path())) GTEST_SKIP() << "the file system has no unnamed files";

  auto file = NewFile::create(folder.path() / "a.txt");

  ASSERT_TRUE(file);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(NewFile, ReplacesNoFileThatAppearsMeanwhile) {
  const support::TemporaryFolder folder;
  auto file = NewFile::create(folder.path() / "a.txt");
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->append("new"));
  folder.write("a.txt", "mine");

  const Status finished = file->finish();

  ASSERT_FALSE(finished);
  EXPECT_THAT(finished.error().message, HasSubstr("the next free name is"));
  EXPECT_EQ(content_of(folder.path() / "a.txt"), "mine");
}

// In a container each run has the same process id.
TEST(NewFile, LeavesThePartFileOfAnotherProcessWithItsId) {
  const support::TemporaryFolder folder;
  const std::string other = "a.txt." + std::to_string(::getpid()) + "-1.part";
  folder.write(other, "another");

  auto file = NewFile::create_part(folder.path() / "a.txt");
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(file->append("new"));
  ASSERT_TRUE(file->finish());

  EXPECT_EQ(content_of(folder.path() / "a.txt"), "new");
  EXPECT_EQ(content_of(folder.path() / other), "another");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 2);
}

TEST(NewFile, NeedsAFolder) {
  const support::TemporaryFolder folder;

  EXPECT_EQ(NewFile::create(folder.path() / "nowhere" / "a.txt").error().code, ErrorCode::Io);
  EXPECT_EQ(NewFile::create_part(folder.path() / "nowhere" / "a.txt").error().code, ErrorCode::Io);
}

}  // namespace new_file_test
}  // namespace mocap::ctl
