#include "lib/functional/motion_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test_motion.h"

namespace mocap::functional {
namespace motion_import_test {

using testing::ElementsAre;

scene::C3d file_with(const std::vector<std::string>& labels) {
  scene::C3d file;
  file.rate_hz = 60.0;
  file.labels = labels;
  return file;
}

// The markers of a robot of two parts, and after them points that are never there.
scene::C3d robot(std::vector<std::string> labels) {
  scene::C3d file = file_with(labels);
  file.frames = 200;
  for (std::size_t f = 0; f < file.frames; ++f) {
    const double rad = 0.05 * static_cast<double>(f);
    const auto turned = kinematics::from_rotation_vector({0.8 * std::sin(rad), 0.8 * std::cos(1.4 * rad), 0.0});
    for (std::size_t m = 0; m < labels.size(); ++m) {
      const Eigen::Vector3d corner(0.1 * static_cast<double>(m % 3 == 1), 0.1 * static_cast<double>(m % 3 == 2), 0.3);
      const Eigen::Vector3d place = m < 3 ? Eigen::Vector3d(-corner) : Eigen::Vector3d(turned * corner);
      file.samples.push_back({place, m < 6, 0.0, 0});
    }
  }
  return file;
}

TEST(MotionImport, IsNeededIfMostLabelsFollowNoConvention) {
  EXPECT_FALSE(has_own_labels(file_with({"LASI", "RASI", "LPSI", "extra"})));
  EXPECT_TRUE(has_own_labels(file_with({"LASI", "one", "two", "three", "*4"})));
  EXPECT_FALSE(has_own_labels(file_with({})));
}

TEST(MotionImport, TakesEachMarkerThatIsThereOnce) {
  const auto import =
      import_by_motion(robot({"s:A1", "s:A2", "s:A3", "s:B1", "s:B2", "s:B3", "s:C", "s:A1", "*7"}), "robot");

  ASSERT_TRUE(import) << import.error().message;
  EXPECT_EQ(import->imported.marker_set.markers.size(), 6u);
  EXPECT_EQ(import->imported.marker_set.skeleton.bones.size(), 2u);
  EXPECT_EQ(import->imported.never_seen, 1u);
  EXPECT_EQ(import->imported.ghosts, 1u);
  EXPECT_THAT(import->imported.twice, ElementsAre("s:A1"));
  EXPECT_EQ(import->joints.size(), 1u);
}

TEST(MotionImport, LeavesOutAMarkerThatIsNeverSeenWithTheOthers) {
  scene::C3d file = robot({"A1", "A2", "A3", "B1", "B2", "B3"});
  for (std::size_t f = 0; f < file.frames; ++f) file.samples[6 * f + 5].there = f >= file.frames - 2;
  for (std::size_t f = file.frames - 2; f < file.frames; ++f) {
    for (std::size_t m = 0; m < 5; ++m) file.samples[6 * f + m].there = false;
  }

  const auto import = import_by_motion(file, "robot");

  ASSERT_TRUE(import) << import.error().message;
  EXPECT_THAT(import->left_out, ElementsAre("B3"));
}

TEST(MotionImport, OfAFileWithoutMarkersFails) { EXPECT_FALSE(import_by_motion(file_with({"*1"}), "nobody")); }

}  // namespace motion_import_test
}  // namespace mocap::functional
