// The settings of a camera against the simulated camera of Aravis, which needs no network: 2048 x 2048 px, exposure 10
// to 1e7 us. aravis_camera_test.cpp and gige_faults_test.cpp have GigE Vision cameras.
#include "cameras/aravis/aravis_features.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
// The C headers of Aravis cause these warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

namespace mocap::cameras {
namespace aravis_features_test {

using testing::HasSubstr;

class ApplySettings : public testing::Test {
 protected:
  void SetUp() override {
    arv_enable_interface("Fake");
    camera_ = arv_camera_new("Fake_1", nullptr);
    ASSERT_NE(camera_, nullptr);
  }
  ~ApplySettings() override { g_clear_object(&camera_); }

  Error refusal_of(const AravisSettings& settings) {
    const Result<AravisFeatures> features = apply_settings(camera_, settings);
    EXPECT_FALSE(features);
    return features ? Error{} : features.error();
  }

  ArvCamera* camera_ = nullptr;
};

TEST_F(ApplySettings, ReadsBackTheValuesOfTheCamera) {
  AravisSettings settings;
  settings.pixel_format = "BayerRG8";
  settings.x_px = 8;
  settings.width_px = 640;
  settings.height_px = 480;
  settings.rate_hz = 50.0;
  settings.exposure_us = 5000.0;
  settings.gain_db = 3.0;

  const Result<AravisFeatures> features = apply_settings(camera_, settings);

  ASSERT_TRUE(features) << features.error().message;
  EXPECT_EQ(features->format, PixelFormat::BayerRg8);
  EXPECT_EQ(features->exposure, std::chrono::milliseconds(5));
  EXPECT_FALSE(features->software_trigger);
  EXPECT_FALSE(features->action_period);
  int x = 0, y = 0, width = 0, height = 0;
  arv_camera_get_region(camera_, &x, &y, &width, &height, nullptr);
  EXPECT_EQ(x, 8);
  EXPECT_EQ(y, 0) << "an absent setting leaves the camera's own value";
  EXPECT_EQ(width, 640);
  EXPECT_EQ(height, 480);
  EXPECT_EQ(arv_camera_get_frame_rate(camera_, nullptr), 50.0);
  EXPECT_EQ(arv_camera_get_gain(camera_, nullptr), 3.0);
}

TEST_F(ApplySettings, StatesASoftwareTrigger) {
  AravisSettings settings;
  settings.trigger = "software";

  const Result<AravisFeatures> features = apply_settings(camera_, settings);

  ASSERT_TRUE(features) << features.error().message;
  EXPECT_TRUE(features->software_trigger);
}

TEST_F(ApplySettings, RefusesAFormatThatTheDaemonCannotRead) {
  AravisSettings settings;
  settings.pixel_format = "RGB8";

  const Error error = refusal_of(settings);

  EXPECT_EQ(error.code, ErrorCode::Unsupported);
  EXPECT_THAT(error.message, HasSubstr("pixel_format RGB8 is not understood; use Mono8"));
}

TEST_F(ApplySettings, RefusesARegionBeyondTheSensor) {
  AravisSettings settings;
  settings.x_px = 1000;
  settings.width_px = 1049;

  const Error error = refusal_of(settings);

  EXPECT_EQ(error.code, ErrorCode::InvalidArgument);
  EXPECT_THAT(error.message, HasSubstr("on a sensor of 2048x2048"));
}

TEST_F(ApplySettings, RefusesAnExposureThatIsLongerThanThePeriod) {
  AravisSettings settings;
  settings.rate_hz = 100.0;
  settings.exposure_us = 10'001.0;
  EXPECT_THAT(refusal_of(settings).message, HasSubstr("longer than the period of 10000 us at 100.0 Hz"));

  settings.trigger = "software";  // the period is that of the trigger
  EXPECT_TRUE(apply_settings(camera_, settings));
}

TEST_F(ApplySettings, SetsAFeatureByNameAndRefusesAnUnknownName) {
  AravisSettings settings;
  settings.features = {{"ExposureTimeAbs", "2500.0"}};
  ASSERT_TRUE(apply_settings(camera_, settings));
  EXPECT_EQ(arv_camera_get_exposure_time(camera_, nullptr), 2500.0);

  settings.features = {{"Gian", "3"}};
  const Error error = refusal_of(settings);
  EXPECT_EQ(error.code, ErrorCode::Unsupported);
  EXPECT_THAT(error.message, HasSubstr("the camera has no feature Gian"));
}

TEST_F(ApplySettings, RefusesActionCommandsThatTheCameraDoesNotAccept) {
  AravisSettings settings;
  settings.trigger = "action";
  EXPECT_EQ(refusal_of(settings).code, ErrorCode::InvalidArgument) << "no rate";

  settings.rate_hz = 50.0;
  const Error error = refusal_of(settings);
  EXPECT_EQ(error.code, ErrorCode::Unsupported);
  EXPECT_THAT(error.message, HasSubstr("does not accept action commands"));
}

}  // namespace aravis_features_test
}  // namespace mocap::cameras
