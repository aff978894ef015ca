#include "base/replace_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <iterator>

#include "support/temporary_folder.h"

namespace mocap {
namespace replace_file_test {

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator{}));
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ReplaceFile, WritesTheNewTextWithThePermissionsOfTheOldFile) {
  const support::TemporaryFolder folder;
  const std::filesystem::path path = folder.write("rig.toml", "old");
  ASSERT_EQ(::chmod(path.c_str(), 0640), 0);

  ASSERT_TRUE(replace_file(path, "new"));

  struct stat found {};
  ASSERT_EQ(::stat(path.c_str(), &found), 0);
  EXPECT_EQ(text_of(path), "new");
  EXPECT_EQ(found.st_mode & 07777U, 0640U);
  EXPECT_EQ(files_in(folder.path()), 1U) << "no temporary file is left";
}

TEST(ReplaceFile, CreatesAFileThatIsNotThere) {
  const support::TemporaryFolder folder;

  ASSERT_TRUE(replace_file(folder.path() / "rig.toml", "text"));

  EXPECT_EQ(text_of(folder.path() / "rig.toml"), "text");
}

TEST(ReplaceFile, FailsWithIoAndLeavesNothingBehind) {
  const support::TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "rig.toml");  // a folder cannot be replaced by a file

  const Status replaced = replace_file(folder.path() / "rig.toml", "text");
  const Status without_folder = replace_file(folder.path() / "none" / "rig.toml", "text");

  ASSERT_FALSE(replaced);
  EXPECT_EQ(replaced.error().code, ErrorCode::Io);
  EXPECT_EQ(files_in(folder.path()), 1U);
  EXPECT_FALSE(without_folder);
}

}  // namespace replace_file_test
}  // namespace mocap
