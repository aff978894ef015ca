#include "audit_changes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene/ring_rig.h"

namespace mocap {
namespace audit_changes_test {

using ::testing::ElementsAre;
using ::testing::Pair;

TEST(AuditChanges, NameEachSettingWithItsValueBeforeAndAfter) {
  settings::DaemonSettings before, now;
  now.detect.min_area_px2 = before.detect.min_area_px2 + 1.0;
  now.detect.threshold = 60.0;

  const auto entries = audit_changes(before, now);

  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].what, "changed");
  EXPECT_THAT(entries[0].details,
              ElementsAre(Pair("setting", "detect.min_area_px2"), Pair("before", "4"), Pair("after", "5")));
  EXPECT_THAT(entries[1].details,
              ElementsAre(Pair("setting", "detect.threshold"), Pair("before", "none"), Pair("after", "60")));
  EXPECT_TRUE(audit_changes(now, now).empty());
}

TEST(AuditChanges, TellHowFarACameraOfACalibrationMoved) {
  settings::DaemonSettings before, now;
  before.rig = now.rig = scene::ring_rig({});
  CameraFromWorld& pose = now.rig[1].camera_from_world;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d centre_m = -pose.rotation.transpose() * pose.translation + Eigen::Vector3d(0.012, 0.0, 0.0);
  pose.rotation = turn * pose.rotation;
  pose.translation = -pose.rotation * centre_m;
  now.capture.rig_file = before.capture.rig_file = "/var/lib/mocapd/rig.toml";

  const auto entries = audit_changes(before, now);

  ASSERT_EQ(entries.size(), 1U);
  EXPECT_EQ(entries[0].what, "calibrated");
  EXPECT_THAT(entries[0].details,
              ElementsAre(Pair("camera", before.rig[1].name), Pair("change", "moved 12.0 mm, turned 0.57 degrees"),
                          Pair("file", "/var/lib/mocapd/rig.toml")));
}

TEST(AuditChanges, CountTheMasksThatWereDrawn) {
  settings::DaemonSettings before, now;
  before.rig = now.rig = scene::ring_rig({});
  before.rig[1].masks.push_back({{{1.0, 1.0}}, {{9.0, 1.0}}, {{9.0, 9.0}}});

  const auto entries = audit_changes(before, now);

  ASSERT_EQ(entries.size(), 1U);
  EXPECT_THAT(entries[0].details, ElementsAre(Pair("setting", "drawn masks of camera cam2"),
                                              Pair("before", "1 polygons"), Pair("after", "0 polygons")));
}

TEST(AuditChanges, CountTheMasksThatWereLearnt) {
  settings::DaemonSettings before, now;
  before.rig = now.rig = scene::ring_rig({});
  now.rig[0].learnt_masks.push_back({{{1.0, 1.0}}, {{9.0, 1.0}}, {{9.0, 9.0}}});

  const auto entries = audit_changes(before, now);

  ASSERT_EQ(entries.size(), 1U);
  EXPECT_THAT(entries[0].details, ElementsAre(Pair("setting", "learnt masks of camera cam1"),
                                              Pair("before", "0 polygons"), Pair("after", "1 polygons")));
}

}  // namespace audit_changes_test
}  // namespace mocap
