#include "calibration/wand/wand_progress.h"

#include <gmock/gmock.h>

#include "lib/simworld/wand_world.h"

namespace mocap::calibration {
namespace wand_progress_test {

using testing::HasSubstr;

const Wand kWand{{0.0, 0.16, 0.5}};

void add_all(const Take& recording, WandProgress& progress) {
  for (std::size_t i = 0; i < recording.cameras[0].size(); ++i) {
    for (std::size_t c = 0; c < recording.cameras.size(); ++c) progress.add(c, recording.cameras[c][i]);
  }
}

TEST(WandProgress, StartsWithAnAdviceForACamera) {
  simworld::WandWorld world({.cameras = 3}, kWand, 1);
  const WandProgress progress(world.truth(), kWand, {});

  EXPECT_FALSE(progress.is_complete());
  EXPECT_THAT(progress.advice(), HasSubstr("has not seen the wand yet"));
}

TEST(WandProgress, IsCompleteWithEnoughSharedSamplesOfAllCameras) {
  simworld::WandWorld world({.cameras = 3, .seconds = 20.0, .rate_hz = 30.0, .body = false}, kWand, 2);
  WandProgress progress(world.truth(), kWand, {.min_samples = 200, .min_coverage = 0.25});

  add_all(world.take(), progress);

  for (std::size_t c = 0; c < 3; ++c) {
    const CameraProgress camera = progress.progress_of(c);
    EXPECT_EQ(camera.images, 600u);
    EXPECT_LE(camera.shared, camera.samples);
    EXPECT_TRUE(camera.is_connected) << c;
  }
  EXPECT_TRUE(progress.is_complete()) << progress.advice();
  EXPECT_EQ(progress.advice(), "");
}

TEST(WandProgress, NamesACameraThatIsNotConnected) {
  simworld::WandWorld world({.cameras = 3, .seconds = 20.0, .rate_hz = 30.0, .body = false}, kWand, 3);
  Take recording = world.take();
  // The third camera sees the wand only while the others do not.
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < recording.cameras[c].size(); ++i) {
      if ((c == 2) != (i < 300)) recording.cameras[c][i].spots.clear();
    }
  }
  WandProgress progress(world.truth(), kWand, {.min_samples = 100, .min_coverage = 0.2});

  add_all(recording, progress);

  EXPECT_FALSE(progress.progress_of(2).is_connected);
  EXPECT_THAT(progress.advice(), HasSubstr("common view of " + world.truth()[2].name));
}

}  // namespace wand_progress_test
}  // namespace mocap::calibration
