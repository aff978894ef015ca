#include "ctl/subject/import_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "settings/subject/marker_set_file.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::ctl {
namespace import_files_test {

namespace fs = std::filesystem;

std::string text_in(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

class SaveImport : public ::testing::Test {
 protected:
  void SetUp() override {
    auto set = settings::load_marker_set(fs::path(support::source_folder()) / "config/markersets/rigid4.toml");
    ASSERT_TRUE(set) << set.error().message;
    set_ = *std::move(set);
    subject_.name = "anna";
    subject_.marker_set_file = files_.marker_set;
    subject_.marker_set = set_;
  }

  // The subject file, which is the last, cannot be written: a folder has the name of its temporary file.
  void block_the_last_file() const {
    fs::create_directory(files_.subject.string() + ".new." + std::to_string(::getpid()) + ".tmp");
  }
  Status save(bool replace) const { return save_import(files_, set_, files_.skeleton, subject_, replace); }
  std::ptrdiff_t count() const { return std::distance(fs::directory_iterator(folder_.path()), {}); }

  support::TemporaryFolder folder_;
  ImportFiles files_ = import_files(folder_.path(), "anna", true);
  MarkerSet set_;
  settings::SubjectFile subject_;
};

TEST_F(SaveImport, WritesTheFiles) {
  ASSERT_TRUE(save(false));

  EXPECT_EQ(count(), 3);
  EXPECT_TRUE(settings::load_marker_set(files_.marker_set));
  EXPECT_FALSE(check_absent(files_));
}

TEST_F(SaveImport, LeavesNoFileIfOneCannotBeWritten) {
  block_the_last_file();

  const Status saved = save(false);

  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().code, ErrorCode::Io);
  EXPECT_EQ(count(), 1);  // the folder
  EXPECT_TRUE(check_absent(files_));
}

TEST_F(SaveImport, LeavesTheFilesBeforeIfOneCannotBeReplaced) {
  folder_.write("anna.skeleton.toml", "old bones");
  folder_.write("anna.markers.toml", "old markers");
  block_the_last_file();

  ASSERT_FALSE(save(true));

  EXPECT_EQ(count(), 3);
  EXPECT_EQ(text_in(files_.skeleton), "old bones");
  EXPECT_EQ(text_in(files_.marker_set), "old markers");
}

TEST_F(SaveImport, KeepsThePermissionsOfAFileThatItReplaces) {
  folder_.write("anna.markers.toml", "old markers");
  fs::permissions(files_.marker_set, fs::perms::owner_read | fs::perms::owner_write);

  ASSERT_TRUE(save(true));

  EXPECT_EQ(fs::status(files_.marker_set).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

}  // namespace import_files_test
}  // namespace mocap::ctl
