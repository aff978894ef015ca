#include "calibrate/rig_import.h"

#include <gmock/gmock.h>

#include "support/random_rig.h"
#include "support/temporary_folder.h"

namespace mocap::calibrate {
namespace rig_import_test {

using calibration::RigFormat;
using support::expect_same_rig;
using support::random_rig;
using ::testing::HasSubstr;

std::string faults_of(const std::string& file, const std::string& text, std::optional<RigFormat> format = {}) {
  const support::TemporaryFolder folder;
  const auto read = read_rig(folder.write(file, text), format);
  return read ? "" : settings::to_text(read.error());
}

TEST(RigImport, ReadsEveryFormatThatIsWritten) {
  const support::TemporaryFolder folder;
  for (const RigFormat format : {RigFormat::OpenCv, RigFormat::Kalibr, RigFormat::Pose2Sim}) {
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
      SCOPED_TRACE(std::string(calibration::name_of(format)) + " seed " + std::to_string(seed));
      const Rig rig = random_rig(seed);

      const auto written = calibration::rig_text(rig, format);
      ASSERT_TRUE(written) << written.error().message;
      const auto read = read_rig(folder.write("rig", written->text), std::nullopt);

      ASSERT_TRUE(read) << settings::to_text(read.error());
      expect_same_rig(read->rig, rig);
    }
  }
}

TEST(RigImport, NamesAnOpenCvCameraAfterItsFile) {
  const support::TemporaryFolder folder;
  const auto read = read_rig(folder.write("hall.yml",
                                          "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
                                          "camera_matrix: [ 800., 0., 320., 0., 800., 240., 0., 0., 1. ]\n"),
                             std::nullopt);

  ASSERT_TRUE(read) << settings::to_text(read.error());
  EXPECT_EQ(read->rig[0].name, "hall");
}

TEST(RigImport, FaultsNameTheFile) {
  EXPECT_THAT(faults_of("f.yaml", "hello"), HasSubstr("f.yaml: is in an unknown format; set --format"));
  EXPECT_THAT(faults_of("g.txt", "<calibration><cameras><camera serial='1'></cameras>"), HasSubstr("g.txt:1:51: "));
}

TEST(RigImport, ListsUnknownKeysOfAPose2SimFile) {
  const support::TemporaryFolder folder;
  std::string text = calibration::rig_text(random_rig(11), RigFormat::Pose2Sim)->text;
  text.insert(text.find("size ="), "cam_id = 3\nerror = 0.2\n");
  text += "\n[charuco]\ncolumns = 8\n";
  const auto file = folder.write("Calib.toml", text);

  const auto read = read_rig(file, RigFormat::Pose2Sim);

  ASSERT_TRUE(read) << settings::to_text(read.error());
  expect_same_rig(read->rig, random_rig(11));
  ASSERT_EQ(read->notices.size(), 3u);
  EXPECT_THAT(read->notices[0], HasSubstr("cam_id"));
  EXPECT_THAT(read->notices[2], HasSubstr("[charuco]"));
}

}  // namespace rig_import_test
}  // namespace mocap::calibrate
