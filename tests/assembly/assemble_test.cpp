#include "assemble.h"

#include <gtest/gtest.h>

#include "cameras/synthetic/synthetic_settings.h"
#include "scene/ring_rig.h"
#include "settings/subject/marker_set_file.h"
#include "support/places.h"

namespace mocap {
namespace assemble_test {

settings::DaemonSettings live_synthetic_daemon(const MarkerSet& worn) {
  settings::DaemonSettings settings;
  settings.rig = scene::ring_rig({.cameras = 3});
  for (const CameraModel& camera : settings.rig) {
    settings.cameras.push_back({camera.name, cameras::SyntheticSettings{}});
    settings.simulated.push_back(worn);
  }
  settings.publish.endpoint = "tcp://127.0.0.1:*";
  return settings;
}

TEST(Assemble, StartsTheMotionOfAllSimulatedCamerasTogether) {
  const auto worn = settings::load_marker_set(support::source_folder() + "/config/markersets/openmocap18.toml");
  ASSERT_TRUE(worn) << worn.error().message;
  const settings::DaemonSettings settings = live_synthetic_daemon(*worn);

  Result<Assembly> assembly = assemble(settings);
  ASSERT_TRUE(assembly) << assembly.error().message;

  std::vector<Timestamp> begins;
  for (runtime::CameraParts& parts : assembly->parts.cameras) {
    ASSERT_TRUE(parts.camera->start());
    const Result<Frame> frame = parts.camera->next(std::chrono::seconds(5));
    ASSERT_TRUE(frame) << frame.error().message;
    const double since_begin_s = static_cast<double>(frame->number) / 60.0;
    begins.push_back(frame->exposed_at - from_s(since_begin_s));
  }
  EXPECT_EQ(begins[1], begins[0]);
  EXPECT_EQ(begins[2], begins[0]);
}

TEST(Assemble, ReportsItsVersionToClients) {
  const auto worn = settings::load_marker_set(support::source_folder() + "/config/markersets/openmocap18.toml");
  ASSERT_TRUE(worn) << worn.error().message;
  const settings::DaemonSettings settings = live_synthetic_daemon(*worn);

  Result<Assembly> assembly = assemble(settings);

  ASSERT_TRUE(assembly) << assembly.error().message;
  EXPECT_EQ(assembly->parts.description.producer.rfind("mocapd 0.", 0), 0U) << assembly->parts.description.producer;
}

TEST(Describe, HasTheRateOfEachCamera) {
  settings::DaemonSettings settings = live_synthetic_daemon({});
  settings.cameras[1].driver.as<cameras::SyntheticSettings>()->rate_hz = 30.0;

  EXPECT_EQ(describe(settings, "session").camera_rates_hz, (std::vector<double>{60.0, 30.0, 60.0}));
}

}  // namespace assemble_test
}  // namespace mocap
