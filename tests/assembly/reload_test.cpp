#include "reload.h"

#include <gmock/gmock.h>

#include <memory>
#include <string>
#include <utility>

#include "settings/rig/rig_file.h"
#include "support/temporary_folder.h"

namespace mocap {
namespace reload_test {

using testing::HasSubstr;
using testing::Not;

const MaskPolygon kLamp{{{10.0, 20.0}}, {{30.0, 20.0}}, {{30.0, 40.5}}};

// Two cameras of which only the first is in the rig file, and no state folder.
class Reload : public testing::Test {
 protected:
  void SetUp() override {
    CameraModel west;
    west.name = "west";
    west.width_px = 640;
    west.height_px = 480;
    west.lens.fx_px = west.lens.fy_px = 500.0;
    ASSERT_TRUE(settings::save_rig(rig_, {west}, {}));
    std::string text = "[capture]\nrig = \"rig.toml\"\nneeds_rig = false\n[control]\nendpoint = \"none\"\n";
    for (const char* name : {"west", "east"}) {
      text += std::string("[[camera]]\nname = \"") + name + "\"\ndriver = \"v4l2\"\ndevice = \"/dev/" + name + "\"\n";
    }
    now_.file = folder_.write("daemon.toml", text);
    auto loaded = load_checked(now_.file, now_.state);
    ASSERT_TRUE(loaded) << settings::to_text(loaded.error());
    now_.settings = std::make_unique<settings::DaemonSettings>(*std::move(loaded));
  }

  support::TemporaryFolder folder_;
  std::filesystem::path rig_ = folder_.path() / "rig.toml";
  Configuration now_;
};

TEST_F(Reload, UsesTheLearntMasksThatHaveAPlaceAndNamesTheCamerasOfTheOthers) {
  runtime::MainOrder order;
  order.masks = {{kLamp}, {kLamp, kLamp}};
  runtime::MainDone answer;

  const auto next = reload(now_, order, answer);

  EXPECT_FALSE(answer.done);
  EXPECT_THAT(answer.message, HasSubstr("has no camera 'east': these masks have no place and are not saved"));
  EXPECT_THAT(answer.message, HasSubstr("the learnt masks of all other cameras are saved"));
  ASSERT_NE(next, nullptr);
  EXPECT_EQ(next->rig[0].learnt_masks.size(), 1U);
  EXPECT_TRUE(next->rig[1].learnt_masks.empty());
}

TEST_F(Reload, RefusesADrawnMaskThatHasNoPlace) {
  runtime::MainOrder order;
  order.drawn = {CameraId{1}, {kLamp}};
  runtime::MainDone answer;

  const auto next = reload(now_, order, answer);

  EXPECT_FALSE(answer.done);
  EXPECT_THAT(answer.message, HasSubstr("has no camera 'east': these masks have no place and are not saved"));
  EXPECT_THAT(answer.message, Not(HasSubstr("in force")));
  EXPECT_EQ(next, nullptr);
}

}  // namespace reload_test
}  // namespace mocap
