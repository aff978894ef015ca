#include "settings/subject/add_subject.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <iterator>

#include "support/temporary_folder.h"

namespace mocap::settings {
namespace add_subject_test {

using testing::HasSubstr;

constexpr const char* kConfiguration = "[capture]  # our hall\nrig = \"hall.rig.toml\"";  // no newline at its end

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(AddSubject, AppendsATableAndKeepsEveryOtherByte) {
  support::TemporaryFolder folder;
  const auto file = folder.write("mocapd.toml", kConfiguration);
  std::filesystem::permissions(file, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);

  const Status added = add_subject(file, {"ben", "/sets/rigid3.toml"}, [](const auto&) { return Faults{}; });

  ASSERT_TRUE(added) << added.error().message;
  EXPECT_EQ(text_of(file),
            fmt::format("{}\n[[subject]]\nname = \"ben\"\nmarker_set = \"/sets/rigid3.toml\"\n", kConfiguration));
  EXPECT_EQ(std::filesystem::status(file).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_EQ(files_in(folder.path()), 1U);
}

TEST(AddSubject, ChangesNothingIfTheNewTextHasFaults) {
  support::TemporaryFolder folder;
  const auto file = folder.write("mocapd.toml", kConfiguration);
  std::string tried;

  const Status added = add_subject(file, {"ben", "/nothere.toml"}, [&](const std::filesystem::path& path) {
    tried = text_of(path);
    return Faults{path, {{path, 5, 1, "there is no such file"}}};
  });

  ASSERT_FALSE(added);
  EXPECT_THAT(added.error().message, HasSubstr("there is no such file"));
  EXPECT_THAT(tried, HasSubstr("/nothere.toml"));
  EXPECT_EQ(text_of(file), kConfiguration);
  EXPECT_EQ(files_in(folder.path()), 1U);
}

TEST(AddSubject, MakesTheFileInTheStateFolder) {
  support::TemporaryFolder folder;
  const auto file = folder.path() / "added.toml";
  const auto good = [](const auto&) { return Faults{}; };

  ASSERT_TRUE(add_subject_to_state(file, {"ben", "/sets/rigid3.toml"}, good));
  ASSERT_TRUE(add_subject_to_state(file, {"eve", "/sets/rigid4.toml"}, good));

  EXPECT_THAT(text_of(file),
              HasSubstr("[[subject]]\nname = \"ben\"\nmarker_set = \"/sets/rigid3.toml\"\n\n[[subject]]\n"
                        "name = \"eve\""));
  EXPECT_EQ(files_in(folder.path()), 1U);
}

TEST(MarkerSetText, IsWrittenIntoANewFile) {
  support::TemporaryFolder folder;
  const auto place = folder.path() / "state" / "marker_sets";

  const auto first = write_marker_set_text(place, "anna", "one");
  const auto second = write_marker_set_text(place, "anna", "two");

  ASSERT_TRUE(first && second);
  EXPECT_EQ(*first, place / "anna.toml");
  EXPECT_EQ(*second, place / "anna-2.toml");
  EXPECT_EQ(text_of(*first), "one");
  EXPECT_EQ(text_of(*second), "two");
  EXPECT_FALSE(write_marker_set_text(folder.write("file", ""), "anna", "three")) << "a file where the folder should be";
}

}  // namespace add_subject_test
}  // namespace mocap::settings
