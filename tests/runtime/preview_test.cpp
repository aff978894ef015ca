#include <gtest/gtest.h>

#include <thread>

#include "runtime/camera/preview_slot.h"
#include "runtime/preview_worker.h"

namespace mocap::runtime {
namespace preview_test {

using std::chrono::milliseconds;

struct Picture {
  explicit Picture(int width_px = 1280, int height_px = 1024)
      : pixels(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px), std::byte{9}) {
    frame.number = 5;
    frame.exposed_at = from_ns(1'000'000);
    frame.received_at = from_ns(2'000'000);
    frame.image = {pixels, static_cast<std::size_t>(width_px), width_px, height_px, PixelFormat::Mono8};
    Blob blob;
    blob.centroid.v = {10.5, 20.25};
    blob.area_px2 = 30.0;
    blobs.push_back(blob);
  }
  std::vector<std::byte> pixels;
  Frame frame;
  Blobs blobs;
};

TEST(PreviewSlot, TakesNothingWhileNobodyWantsPreviews) {
  Picture picture;
  PreviewSlot slot;

  EXPECT_FALSE(slot.offer(picture.frame, picture.blobs));
  EXPECT_EQ(slot.waiting(), nullptr);
}

TEST(PreviewSlot, TakesADecimatedImageWithItsBlobs) {
  Picture picture;
  PreviewSlot slot;
  slot.set_wanted(true);

  ASSERT_TRUE(slot.offer(picture.frame, picture.blobs));

  const PreviewImage* image = slot.waiting();
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(image->head.number, 5U);
  EXPECT_EQ(image->head.width_px(), 640);
  EXPECT_EQ(image->head.height_px(), 512);
  EXPECT_EQ(image->grey, std::vector<std::uint8_t>(640 * 512, 9));
  ASSERT_EQ(image->head.blobs.size(), 1U);
  EXPECT_EQ(image->head.blobs[0].x_px, 10.5F);
  EXPECT_EQ(image->head.blobs[0].area_px2, 30.0F);
}

TEST(PreviewSlot, IsBoundedForImagesOfEverySize) {
  for (const auto& [width, height] : {std::pair{640, 640}, {641, 1}, {1, 5000}, {4096, 3000}}) {
    Picture picture(width, height);
    PreviewSlot slot;
    slot.set_wanted(true);

    ASSERT_TRUE(slot.offer(picture.frame, picture.blobs));

    EXPECT_LE(slot.waiting()->head.width_px(), kMaxPreview_px);
    EXPECT_LE(slot.waiting()->head.height_px(), kMaxPreview_px);
  }
}

TEST(PreviewSlot, TakesAtMostTenImagesASecondAndOneAtATime) {
  Picture picture;
  PreviewSlot slot;
  slot.set_wanted(true);
  ASSERT_TRUE(slot.offer(picture.frame, picture.blobs));

  picture.frame.received_at += milliseconds(150);
  EXPECT_FALSE(slot.offer(picture.frame, picture.blobs)) << "the first one was not released";
  slot.release();
  EXPECT_TRUE(slot.offer(picture.frame, picture.blobs));
  slot.release();
  picture.frame.received_at += milliseconds(99);
  EXPECT_FALSE(slot.offer(picture.frame, picture.blobs));
  picture.frame.received_at += milliseconds(1);
  EXPECT_TRUE(slot.offer(picture.frame, picture.blobs));
}

TEST(PreviewSlot, IgnoresAnImageThatIsNotWhole) {
  Picture picture;
  picture.frame.image.bytes = picture.frame.image.bytes.first(100);
  PreviewSlot slot;
  slot.set_wanted(true);

  EXPECT_FALSE(slot.offer(picture.frame, picture.blobs));
}

// "Compresses" an image to its first byte; fails for images whose first byte is 0.
class FirstByte : public PreviewEncoder {
 public:
  Result<std::span<const std::byte>> encode(const PreviewImage& image) override {
    first_ = static_cast<std::byte>(image.grey[0]);
    if (first_ == std::byte{0}) return Error{ErrorCode::Io, "no image"};
    return std::span<const std::byte>(&first_, 1);
  }

 private:
  std::byte first_{};
};

TEST(PreviewWorker, CompressesTheImagesOfAllCamerasAndSurvivesAFailure) {
  WakeSignal fusion;
  CameraChannel broken(1, fusion), good(1, fusion);
  PreviewChannel channel;
  PreviewWorker worker(std::make_unique<FirstByte>(), {&broken, &good}, channel);
  Picture dark(16, 16), bright(16, 16);
  dark.pixels[0] = std::byte{0};
  dark.frame.camera = CameraId{0};
  bright.frame.camera = CameraId{1};
  std::jthread thread([&](const std::stop_token& stop) { worker.run(stop); });
  for (auto& [camera, picture] : {std::pair{&broken, &dark}, {&good, &bright}}) {
    camera->preview.set_wanted(true);
    ASSERT_TRUE(camera->preview.offer(picture->frame, picture->blobs));
    channel.there_is_work.signal();
  }

  Preview preview;
  const Timestamp limit = host_now() + std::chrono::seconds(60);
  while (!channel.previews.try_pop(preview) && host_now() < limit) std::this_thread::yield();

  EXPECT_EQ(preview.head.camera, CameraId{1});
  EXPECT_EQ(preview.jpeg, std::vector{std::byte{9}});
  while (broken.preview.waiting() != nullptr && host_now() < limit) std::this_thread::yield();
  EXPECT_EQ(broken.preview.waiting(), nullptr);
}

}  // namespace preview_test
}  // namespace mocap::runtime
