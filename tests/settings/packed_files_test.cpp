#include "settings/packed_files.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>

#include "settings/rig/rig_file.h"
#include "settings/subject/marker_set_file.h"
#include "settings/subject/subject_file.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::settings {
namespace packed_files_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A configuration with a marker set, a skeleton and a rig of its own.
class PackedFiles : public testing::Test {
 protected:
  PackedFiles() {
    CameraModel camera;
    camera.name = "west";
    camera.width_px = 640;
    camera.height_px = 480;
    camera.lens.fx_px = camera.lens.fy_px = 500.0;
    std::filesystem::create_directories(folder_.path() / "rigs");
    EXPECT_TRUE(save_rig(folder_.path() / "rigs/hall.toml", {camera}, {}));
    copy("markersets/openmocap18.toml", "sets/own18.toml");
    copy("skeletons/human18.toml", "skeletons/human18.toml");
    configure("");
  }

  void copy(const std::string& shipped, const std::string& name) const {
    std::filesystem::create_directories((folder_.path() / name).parent_path());
    std::filesystem::copy_file(support::source_folder() + "/config/" + shipped, folder_.path() / name);
  }

  void configure(const std::string& subject) {
    config_ = folder_.write("hall/mocapd.toml",
                            "[capture]\nrig = \"../rigs/hall.toml\"\n[label]\nmost_rms_mm = 17\n[[camera]]\nname = "
                            "\"west\"\ndriver = \"replay\"\nfolder = \"/tmp\"\n[[subject]]\nname = \"anna\"  # tall\n"
                            "marker_set = \"../sets/own18.toml\"\n" +
                                subject);
  }

  DaemonSettings load(const std::filesystem::path& config, const StateFiles& state = {}) const {
    auto loaded = load_daemon_settings(config, state);
    EXPECT_TRUE(loaded) << to_text(loaded.error());
    return loaded ? *std::move(loaded) : DaemonSettings{};
  }

  static std::vector<std::string> names_of(const std::vector<PackedFile>& files) {
    std::vector<std::string> names;
    for (const PackedFile& file : files) names.push_back(file.name);
    return names;
  }

  // Unpacks into an empty folder, and loads.
  DaemonSettings unpacked(const std::vector<PackedFile>& files) const {
    const auto into = unpack_files(files, empty_.path());
    EXPECT_TRUE(into) << into.error().message;
    return into ? load(into->configuration, into->state) : DaemonSettings{};
  }

  support::TemporaryFolder folder_, empty_;
  std::filesystem::path config_;
};

TEST_F(PackedFiles, AreAllFilesOfAConfiguration) {
  EXPECT_THAT(names_of(pack_files(load(config_))), ElementsAre("configuration/mocapd.toml", "rig/hall.toml",
                                                               "markersets/own18.toml", "skeletons/human18.toml"));
}

TEST_F(PackedFiles, GiveTheSameSettingsWithoutTheOriginalFiles) {
  const DaemonSettings before = load(config_);
  const std::vector<PackedFile> files = pack_files(before);
  for (const char* part : {"hall", "rigs", "sets", "skeletons"}) std::filesystem::remove_all(folder_.path() / part);

  const DaemonSettings after = unpacked(files);

  ASSERT_EQ(after.rig.size(), 1U);
  EXPECT_EQ(after.rig[0].lens.fx_px, 500.0);
  EXPECT_EQ(after.label.most_rms_m, 0.017);
  ASSERT_EQ(after.subject_models.size(), 1U);
  EXPECT_FALSE(after.subject_models[0].fitted);
  EXPECT_EQ(after.subject_models[0].marker_set.markers.size(), before.subject_models[0].marker_set.markers.size());
  EXPECT_TRUE(std::filesystem::path(after.subjects[0].marker_set_file).string().starts_with(empty_.path().string()));
}

TEST_F(PackedFiles, HaveTheBodyThatIsInForce) {
  SubjectFile body;
  body.name = "anna";
  body.marker_set_file = folder_.path() / "sets/own18.toml";
  body.marker_set = *load_marker_set(body.marker_set_file);
  const double in_force_m = body.marker_set.markers[0].offset_m.x() + 0.0123;
  body.marker_set.markers[0].offset_m.x() = in_force_m;
  body.bone_residuals_m.assign(body.marker_set.skeleton.bones.size(), 0.0);
  body.marker_residuals_m.assign(body.marker_set.markers.size(), 0.0);
  ASSERT_TRUE(save_subject(folder_.path() / "kept.toml", body));
  configure("keep = \"" + (folder_.path() / "kept.toml").string() + "\"\n");
  const std::vector<PackedFile> files = pack_files(load(config_));
  body.marker_set.markers[0].offset_m.x() += 1.0;
  ASSERT_TRUE(save_subject(folder_.path() / "kept.toml", body));

  const DaemonSettings after = unpacked(files);

  ASSERT_EQ(after.subject_models.size(), 1U);
  EXPECT_TRUE(after.subject_models[0].fitted);
  EXPECT_EQ(after.subject_models[0].marker_set.markers[0].offset_m.x(), in_force_m);
  EXPECT_TRUE(after.kept.empty()) << "an unpacked configuration writes nothing";
}

TEST_F(PackedFiles, HaveTheSubjectsOfTheStateFolder) {
  const StateFiles state = state_files(folder_.path() / "state");
  folder_.write("state/added_subjects.toml", "[[subject]]\nname = \"ben\"\nmarker_set = \"" +
                                                 (folder_.path() / "sets/own18.toml").string() + "\"\n");

  const DaemonSettings after = unpacked(pack_files(load(config_, state)));

  ASSERT_EQ(after.subjects.size(), 2U);
  EXPECT_EQ(after.subjects[1].name, "ben");
}

TEST_F(PackedFiles, OfOneNameInTwoFoldersAreNotMixedUp) {
  copy("markersets/baseline41.toml", "others/own18.toml");
  configure("[[subject]]\nname = \"ben\"\nmarker_set = \"../others/own18.toml\"\n");

  const DaemonSettings after = unpacked(pack_files(load(config_)));

  ASSERT_EQ(after.subject_models.size(), 2U);
  EXPECT_EQ(after.subject_models[0].marker_set.markers.size(), 18U);
  EXPECT_EQ(after.subject_models[1].marker_set.markers.size(), 41U);
}

TEST_F(PackedFiles, ThatAreAmbiguousAreRefused) {
  std::vector<PackedFile> files = pack_files(load(config_));
  files.push_back({"markersets/a/own18.toml", files[2].bytes});
  files.push_back({"markersets/b/own18.toml", files[2].bytes});
  std::erase_if(files, [](const PackedFile& file) { return file.name == "markersets/own18.toml"; });

  const auto into = unpack_files(files, empty_.path());

  ASSERT_FALSE(into);
  EXPECT_THAT(into.error().message, HasSubstr("own18.toml' may be one of several files"));
}

TEST_F(PackedFiles, NeverLeaveTheirFolder) {
  std::vector<PackedFile> files = pack_files(load(config_));
  for (const char* name :
       {"/tmp/mocap-evil.toml", "../evil.toml", "rig/../../evil.toml", "rig", "", "other/evil.toml"}) {
    files.push_back({name, "evil = 1\n"});
  }

  ASSERT_TRUE(unpack_files(files, empty_.path() / "deep"));

  EXPECT_FALSE(std::filesystem::exists("/tmp/mocap-evil.toml"));
  EXPECT_FALSE(std::filesystem::exists(empty_.path() / "evil.toml"));
  std::size_t written = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(empty_.path())) {
    written += entry.is_regular_file() ? 1 : 0;
  }
  EXPECT_EQ(written, 4U);
}

TEST_F(PackedFiles, WithoutAConfigurationAreRefused) {
  const auto into = unpack_files({{"rig/hall.toml", ""}}, empty_.path());

  ASSERT_FALSE(into);
  EXPECT_EQ(into.error().code, ErrorCode::NotFound);
}

TEST_F(PackedFiles, ThatAreNoTomlAreRefusedWithTheirLine) {
  const auto into = unpack_files({{"configuration/mocapd.toml", "[capture]\nrig = \n"}}, empty_.path());

  ASSERT_FALSE(into);
  EXPECT_THAT(into.error().message, HasSubstr("configuration/mocapd.toml:2:"));
}

}  // namespace packed_files_test
}  // namespace mocap::settings
