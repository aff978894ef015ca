#include "base/list_folder.h"

#include <gmock/gmock.h>

#include "support/temporary_folder.h"

namespace mocap {
namespace list_folder_test {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(ListFolder, GivesFilesAndFoldersInOrder) {
  const support::TemporaryFolder folder;
  folder.write("b.txt", "");
  folder.write("a.txt", "");
  std::filesystem::create_directory(folder.path() / "c");

  const FolderContents contents = list_folder(folder.path());

  EXPECT_FALSE(contents.error);
  EXPECT_THAT(contents.paths, ElementsAre(folder.path() / "a.txt", folder.path() / "b.txt", folder.path() / "c"));
}

TEST(ListFolder, SaysWhyItReadNothing) {
  const support::TemporaryFolder folder;

  const FolderContents missing = list_folder(folder.path() / "none");
  const FolderContents not_a_folder = list_folder(folder.write("file", ""));

  EXPECT_EQ(missing.error, std::errc::no_such_file_or_directory);
  EXPECT_THAT(missing.paths, IsEmpty());
  EXPECT_EQ(not_a_folder.error, std::errc::not_a_directory);
}

}  // namespace list_folder_test
}  // namespace mocap
