#include "settings/shipped_files.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace mocap::settings {
namespace shipped_files_test {

class ShippedFiles : public testing::Test {
 protected:
  support::TemporaryFolder beside_;
  support::TemporaryFolder shipped_;
};

TEST_F(ShippedFiles, AreFoundIfNothingIsBesideTheNamingFile) {
  const auto file = shipped_.write("sets/a.toml", "shipped");

  const FoundFile found = find_file("sets/a.toml", beside_.path(), shipped_.path());

  EXPECT_EQ(found.path, file);
  EXPECT_EQ(found.missing, "");
}

TEST_F(ShippedFiles, GiveWayToTheFileBesideTheNamingFile) {
  shipped_.write("sets/a.toml", "shipped");
  const auto file = beside_.write("sets/a.toml", "own");

  EXPECT_EQ(find_file("sets/a.toml", beside_.path(), shipped_.path()).path, file);
}

TEST_F(ShippedFiles, NameBothPlacesIfNeitherHasTheFile) {
  const FoundFile found = find_file("a.toml", beside_.path(), shipped_.path());

  EXPECT_EQ(found.path, beside_.path() / "a.toml");
  EXPECT_EQ(found.missing, "neither " + (beside_.path() / "a.toml").string() + " nor " +
                               (shipped_.path() / "a.toml").string() + " exists");
}

TEST_F(ShippedFiles, AreNotSearchedForAnAbsolutePath) {
  shipped_.write("a.toml", "shipped");
  const auto absolute = beside_.path() / "a.toml";

  const FoundFile found = find_file(absolute, "/", shipped_.path());

  EXPECT_EQ(found.path, absolute);
  EXPECT_EQ(found.missing, absolute.string() + ": no such file");
}

TEST_F(ShippedFiles, AreNotSearchedForAPathThatLeavesTheirFolder) {
  const FoundFile found = find_file("../../a.toml", beside_.path() / "x/y", shipped_.path());

  EXPECT_EQ(found.missing, (beside_.path() / "a.toml").string() + ": no such file");
}

TEST_F(ShippedFiles, MayBeInASisterFolder) {
  const auto file = shipped_.write("skeletons/a.toml", "shipped");

  EXPECT_EQ(find_file("../skeletons/a.toml", beside_.path(), shipped_.path() / "markersets").path, file);
}

}  // namespace shipped_files_test
}  // namespace mocap::settings
