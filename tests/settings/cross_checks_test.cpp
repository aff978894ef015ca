#include "settings/cross_checks.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cameras/synthetic/synthetic_settings.h"
#include "cameras/v4l2/v4l2_settings.h"
#include "support/temporary_folder.h"

namespace mocap::settings {
namespace cross_checks_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// A configuration in memory, over a file that has the tables of its cameras.
class CrossChecks : public testing::Test {
 protected:
  void add(const std::string& name, cameras::DriverSettings driver) {
    settings_.cameras.push_back({name, std::move(driver)});
    text_ += fmt::format("[[camera]]\nname = \"{}\"\n", name);
  }

  DaemonTables& open() {
    file_.emplace(*TomlFile::open(folder_.write("a.toml", text_)));
    tables_.emplace(DaemonTables{file_->root(), {}, {}, {}});
    tables_->cameras = tables_->root.tables("camera", "camera");
    return *tables_;
  }

  std::vector<std::string> faults() const {
    std::vector<std::string> messages;
    for (const Fault& fault : file_->faults().list) messages.push_back(fault.message);
    return messages;
  }

  support::TemporaryFolder folder_;
  std::string text_;
  DaemonSettings settings_;
  std::optional<TomlFile> file_;
  std::optional<DaemonTables> tables_;
};

cameras::V4l2Settings video(const std::string& serial) {
  cameras::V4l2Settings camera;
  camera.serial = serial;
  return camera;
}

TEST_F(CrossChecks, TakeCamerasThatDiffer) {
  add("west", video("A"));
  add("east", video("B"));

  check_together(open(), settings_);

  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(CrossChecks, RefuseOneDeviceUnderTwoNames) {
  add("west", video("A"));
  add("east", video("A"));

  check_together(open(), settings_);

  EXPECT_THAT(faults(), ElementsAre("camera 2: serial 'A' is there twice, expected a different one each"));
}

TEST_F(CrossChecks, TakeOneSerialNumberOfTwoMakes) {
  cameras::V4l2Settings of_kernel = video("A");
  add("west", of_kernel);
  add("east", cameras::SyntheticSettings{});

  check_together(open(), settings_);

  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(CrossChecks, RefuseSubjectsOfANode) {
  add("west", video("A"));
  text_ += "[[subject]]\nname = \"anna\"\n";
  settings_.subjects.push_back({.name = "anna", .marker_set_file = {}, .file = {}, .keep = {}});
  settings_.node.endpoint = "tcp://127.0.0.1:5575";
  open();
  tables_->subjects = tables_->root.tables("subject", "subject");

  check_together(*tables_, settings_);

  EXPECT_THAT(faults(), ElementsAre(HasSubstr("a node has no [[subject]]: the fusion host solves the skeletons")));
}

TEST_F(CrossChecks, CheckTheRulesOfEverySection) {
  add("west", video("A"));
  settings_.detect.min_area_px2 = 9000.0;
  settings_.record.blobs = "take.pb";

  check_together(open(), settings_);

  EXPECT_THAT(faults(), ElementsAre(HasSubstr("min_area_px2 is 9000"), HasSubstr("blobs is 'take.pb'")));
}

TEST_F(CrossChecks, FindEachCameraInTheRigWithItsSize) {
  add("west", video("A"));
  add("east", video("B"));
  CameraModel model;
  model.name = "east";
  model.width_px = 640;
  model.height_px = 480;
  CameraModel other = model;
  other.name = "west";
  other.width_px = 1280;

  const Rig whole = rig_for(open(), settings_, {model, other});
  const std::vector<std::string> of_size = faults();
  const Rig part = rig_for(open(), settings_, {model});

  ASSERT_EQ(whole.size(), 2U);
  EXPECT_EQ(whole[0].name, "west") << "in the order of the cameras";
  EXPECT_THAT(of_size, ElementsAre(HasSubstr("size is 640x480 px, but the rig")));
  EXPECT_EQ(part.size(), 1U);
  EXPECT_THAT(faults(), ElementsAre(HasSubstr("is not in the rig")));
}

}  // namespace cross_checks_test
}  // namespace mocap::settings
