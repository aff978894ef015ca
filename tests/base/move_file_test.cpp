#include "base/move_file.h"

#include <gtest/gtest.h>

#include <cerrno>

#include "support/temporary_folder.h"

namespace mocap {
namespace move_file_test {

TEST(MoveWithoutReplacing, GivesAnotherName) {
  const support::TemporaryFolder folder;
  const auto from = folder.write("from", "text");

  ASSERT_TRUE(move_without_replacing(from, folder.path() / "to"));

  EXPECT_FALSE(std::filesystem::exists(from));
  EXPECT_EQ(std::filesystem::file_size(folder.path() / "to"), 4U);
}

TEST(MoveWithoutReplacing, KeepsAnExistingFile) {
  const support::TemporaryFolder folder;
  const auto from = folder.write("from", "text"), to = folder.write("to", "");

  EXPECT_FALSE(move_without_replacing(from, to));

  EXPECT_EQ(errno, EEXIST);
  EXPECT_TRUE(std::filesystem::exists(from));
  EXPECT_EQ(std::filesystem::file_size(to), 0U);
}

}  // namespace move_file_test
}  // namespace mocap
