#include "settings/toml/text_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace mocap::settings {
namespace text_file_test {

TEST(ReadText, GivesEveryByteOfAFile) {
  const support::TemporaryFolder folder;
  const std::string text("rig = \"a\"\r\n\0\xff", 13);

  const auto read = read_text(folder.write("a.toml", text));

  ASSERT_TRUE(read);
  EXPECT_EQ(*read, text);
}

TEST(ReadText, RefusesWhatIsNoSettingsFile) {
  const support::TemporaryFolder folder;

  EXPECT_EQ(read_text(folder.path() / "none.toml").error().message, "no such file");
  EXPECT_EQ(read_text(folder.path()).error().message, "is a folder, expected a file");
  EXPECT_EQ(read_text(folder.write("large.toml", std::string((16U << 20) + 1, ' '))).error().message,
            "is over 16 MB, expected a settings file");
}

TEST(ReadText, GivesNoPartOfAFileThatCannotBeRead) {
  // Its open succeeds and its first read fails with EIO, as on a disk with a fault.
  const auto read = read_text("/proc/self/mem");

  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, "cannot be read; check its permissions and its disk");
}

}  // namespace text_file_test
}  // namespace mocap::settings
