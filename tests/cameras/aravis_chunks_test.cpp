// Chunk data without images; gige_chunks_test.cpp has images with chunks.
#include "cameras/aravis/aravis_chunks.h"

#include <gtest/gtest.h>
// The C headers of Aravis cause these warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

#include <memory>
#include <string>

#include "cameras/own_network.h"
#include "cameras/served_gige.h"

namespace mocap::cameras {
namespace aravis_chunks_test {

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
using Camera = std::unique_ptr<ArvCamera, Unref>;

TEST(AravisChunks, AreAbsentIfTheCameraHasNone) {
  arv_enable_interface("Fake");
  const Camera camera(arv_camera_new("Fake_1", nullptr));
  ASSERT_TRUE(camera);

  EXPECT_EQ(AravisChunks::turn_on(camera.get()), nullptr);
  AravisChunks::turn_off(camera.get());  // does nothing
}

class ServedChunks : public testing::Test {
 protected:
  void SetUp() override {
    static const std::string refusal = enter_own_network(1);
    if (!refusal.empty()) GTEST_SKIP() << refusal;
  }
};

TEST_F(ServedChunks, AreEnabledAndDisabledInTheCamera) {
  ServedGigE served("127.0.0.2", "K1");
  ASSERT_TRUE(served.running());
  const Camera camera(arv_camera_new("127.0.0.2", nullptr));
  ASSERT_TRUE(camera);

  const auto chunks = AravisChunks::turn_on(camera.get());

  ASSERT_TRUE(chunks);
  EXPECT_EQ(chunks->names(), "Timestamp, ExposureTime");
  EXPECT_TRUE(arv_camera_get_chunk_mode(camera.get(), nullptr));
  AravisChunks::turn_off(camera.get());
  EXPECT_FALSE(arv_camera_get_chunk_mode(camera.get(), nullptr));
}

TEST_F(ServedChunks, AreNotReadAnyMoreIfThreeImagesInARowLackThem) {
  ServedGigE served("127.0.0.2", "K2");
  ASSERT_TRUE(served.running());
  const Camera camera(arv_camera_new("127.0.0.2", nullptr));
  ASSERT_TRUE(camera);
  const auto chunks = AravisChunks::turn_on(camera.get());
  ASSERT_TRUE(chunks);
  const std::unique_ptr<ArvBuffer, Unref> without_chunks(arv_buffer_new(100, nullptr));

  for (int image = 1; image <= 2; ++image) {
    const AravisChunks::Values values = chunks->read(without_chunks.get());
    EXPECT_FALSE(values.begin);
    EXPECT_FALSE(values.exposure);
    EXPECT_EQ(chunks->names(), "Timestamp, ExposureTime") << image;
  }
  EXPECT_FALSE(chunks->read(without_chunks.get()).begin);

  EXPECT_EQ(chunks->names(), "");
  EXPECT_FALSE(chunks->read(without_chunks.get()).exposure);
}

}  // namespace aravis_chunks_test
}  // namespace mocap::cameras
