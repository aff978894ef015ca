#include "base/install_folders.h"

#include <gtest/gtest.h>

namespace mocap {
namespace install_folders_test {

TEST(InstallFolders, AreFoundFromTheProgramUnderAnyPrefix) {
  const InstallFolders folders = install_folders_of("/opt/motion capture/bin/mocapd");

  EXPECT_EQ(folders.data, "/opt/motion capture/share/mocapd");
  EXPECT_EQ(folders.plugins, "/opt/motion capture/lib/mocapd");
}

TEST(InstallFolders, AreEmptyForAnUnknownProgram) {
  const InstallFolders folders = install_folders_of({});

  EXPECT_TRUE(folders.data.empty());
  EXPECT_TRUE(folders.plugins.empty());
}

TEST(InstallFolders, OfTheBuildTreeHaveTheShippedFiles) {
  EXPECT_TRUE(std::filesystem::exists(install_folders().data / "markersets" / "openmocap18.toml"));
  EXPECT_TRUE(std::filesystem::exists(install_folders().data / "skeletons" / "human18.toml"));
}

}  // namespace install_folders_test
}  // namespace mocap
