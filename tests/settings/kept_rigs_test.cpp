#include "settings/rig/kept_rigs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "settings/rig/rig_file.h"
#include "support/failing_folder.h"
#include "support/temporary_folder.h"

namespace mocap::settings {
namespace kept_rigs_test {

CalibratedRig rig_at(double x_m) {
  CameraModel camera;
  camera.name = "cam1";
  camera.width_px = 640;
  camera.height_px = 480;
  camera.lens.fx_px = camera.lens.fy_px = 500.0;
  camera.lens.cx_px = 320.0;
  camera.lens.cy_px = 240.0;
  camera.camera_from_world.translation.x() = x_m;
  return {{camera}, {{"rms_px", 0.125}}};
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(KeptRigs, KeepsTheRigBeforeAndGoesBackToIt) {
  const support::TemporaryFolder folder;
  const RigPlaces places{folder.path() / "rig.toml", folder.path() / "rig.toml", folder.path() / "rigs"};
  std::ofstream(places.in_force) << "# by hand\n";

  ASSERT_TRUE(write_rig(places, rig_at(1.0)));
  ASSERT_TRUE(write_rig(places, rig_at(2.0)));
  const std::vector<KeptRig> kept = list_rigs(places);
  ASSERT_EQ(kept.size(), 3u) << "the one by hand and both of the daemon";
  const auto in_force = std::ranges::find(kept, true, &KeptRig::in_force);
  ASSERT_NE(in_force, kept.end());
  EXPECT_EQ(in_force->cameras, 1u);
  EXPECT_EQ(in_force->rms_px, 0.125);
  EXPECT_EQ(in_force->solved_by, "mocapd");
  EXPECT_EQ((*load_rig(places.in_force))[0].camera_from_world.translation.x(), 2.0);

  const auto earlier =
      std::ranges::find_if(kept, [](const KeptRig& rig) { return !rig.in_force && rig.solved_by == "mocapd"; });
  ASSERT_NE(earlier, kept.end());
  ASSERT_TRUE(restore_rig(places, earlier->name));
  EXPECT_EQ((*load_rig(places.in_force))[0].camera_from_world.translation.x(), 1.0);
  EXPECT_EQ(list_rigs(places).size(), 3u);
}

TEST(KeptRigs, KeepsTheRigInForceOnceAndANewRigBesideIt) {
  const support::TemporaryFolder folder;
  const RigPlaces places{folder.path() / "rig.toml", folder.path() / "rig.toml", folder.path() / "rigs"};
  const auto none = keep_rig_in_force(places);
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->empty()) << "there is no file";
  EXPECT_FALSE(std::filesystem::exists(places.kept));
  std::ofstream(places.in_force) << "# by hand\n";

  const auto first = keep_rig_in_force(places);
  const auto again = keep_rig_in_force(places);
  const auto other = keep_rig(places, rig_at(1.0));

  ASSERT_TRUE(first && again && other);
  EXPECT_EQ(text_of(*first), "# by hand\n");
  EXPECT_EQ(*again, *first);
  EXPECT_EQ((*load_rig(*other))[0].camera_from_world.translation.x(), 1.0);
  EXPECT_EQ(text_of(places.in_force), "# by hand\n");
}

TEST(KeptRigs, RefusesAnUnknownNameAndAFileWithFaults) {
  const support::TemporaryFolder folder;
  const RigPlaces places{folder.path() / "rig.toml", folder.path() / "rig.toml", folder.path() / "rigs"};
  std::ofstream(places.in_force) << "no rig\n";
  ASSERT_TRUE(write_rig(places, rig_at(1.0)));
  const std::string before = text_of(places.in_force);

  EXPECT_EQ(restore_rig(places, "../rig").error().code, ErrorCode::NotFound);
  for (const KeptRig& rig : list_rigs(places)) {
    if (rig.cameras > 0) continue;
    EXPECT_EQ(restore_rig(places, rig.name).error().code, ErrorCode::InvalidArgument);
  }
  EXPECT_EQ(text_of(places.in_force), before);
}

TEST(KeptRigs, AreThoseBeforeAFailureOfTheDisk) {
  const support::TemporaryFolder folder;
  const RigPlaces places{folder.path() / "rig.toml", folder.path() / "rig.toml", folder.path()};
  for (int i = 0; i < 5; ++i) std::ofstream(folder.path() / ("rig" + std::to_string(i) + ".toml")) << "# by hand\n";
  ASSERT_EQ(list_rigs(places).size(), 5U);

  const support::FailingFolder failing;
  std::size_t kept = 5;
  EXPECT_NO_THROW(kept = list_rigs(places).size());

  EXPECT_EQ(kept, 1U);
}

TEST(KeptRigs, AreInTheStateFolderIfThereIsOne) {
  DaemonSettings settings;
  EXPECT_FALSE(rig_places(settings)) << "there is no file to write";
  settings.capture.rig_file = "/etc/mocapd/rig.toml";
  EXPECT_EQ(rig_places(settings)->kept, "/etc/mocapd/rigs");
  settings.state = state_files("/var/lib/mocapd");
  EXPECT_EQ(rig_places(settings)->written, "/var/lib/mocapd/rig.toml");
  EXPECT_EQ(rig_places(settings)->in_force, "/etc/mocapd/rig.toml");
}

TEST(KeptRigs, UndoesARigThatTheConfigurationRefuses) {
  const support::TemporaryFolder folder;
  const RigPlaces places{folder.path() / "rig.toml", folder.path() / "rig.toml", folder.path() / "rigs"};
  const auto none = written_rig(places);
  ASSERT_TRUE(write_rig(places, rig_at(1.0)));
  const auto first = written_rig(places);
  ASSERT_TRUE(write_rig(places, rig_at(2.0)));

  ASSERT_TRUE(undo_rig(places, *first));
  EXPECT_EQ((*load_rig(places.in_force))[0].camera_from_world.translation.x(), 1.0);
  ASSERT_TRUE(undo_rig(places, *none));
  EXPECT_FALSE(std::filesystem::exists(places.written));
  EXPECT_EQ(list_rigs(places).size(), 2u);
}

TEST(KeptRigs, ANewFloorKeepsTheResidualOfTheCameras) {
  const support::TemporaryFolder folder;
  const RigPlaces places{folder.path() / "rig.toml", folder.path() / "rig.toml", folder.path() / "rigs"};
  ASSERT_TRUE(write_rig(places, rig_at(1.0)));
  CalibratedRig placed = rig_at(2.0);
  placed.facts = {{"floor_rms_mm", 0.2}};

  ASSERT_TRUE(write_rig(places, placed));

  const std::vector<KeptRig> kept = list_rigs(places);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_TRUE(kept[0].in_force) << "the newest is the first, also of two in one second";
  EXPECT_EQ(kept[0].rms_px, 0.125);
}

TEST(KeptRigs, WritesNothingIfTheRigInForceCannotBeReadAndKept) {
  const support::TemporaryFolder folder;
  const RigPlaces places{folder.path() / "rig.toml", folder.path() / "rig.toml", folder.path() / "rigs"};
  std::filesystem::create_symlink("/proc/self/mem", places.in_force);  // its first read fails with EIO

  const Status written = write_rig(places, rig_at(1.0));

  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::Io);
  EXPECT_TRUE(std::filesystem::is_symlink(places.in_force));
  EXPECT_FALSE(written_rig(places)) << "undo_rig would remove the rig";
}

}  // namespace kept_rigs_test
}  // namespace mocap::settings
