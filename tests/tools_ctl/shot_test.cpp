#include "ctl/camera/shot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "cameras/replay/image_file.h"
#include "support/temporary_folder.h"

namespace mocap::ctl {
namespace shot_test {

TEST(Shot, ShowsTheImageWithABoxAndTheIndexOfEachBlob) {
  const std::vector<std::byte> pixels(40 * 30, std::byte{7});
  const Image image{pixels, 40, 40, 30, PixelFormat::Mono8};
  Blobs blobs;
  for (const PixelPoint& centroid : {PixelPoint{{10.0, 12.0}}, PixelPoint{{39.0, 0.0}}}) {  // the second at the border
    Blob blob;
    blob.centroid = centroid;
    blobs.push_back(blob);
  }
  const support::TemporaryFolder folder;

  const Status saved = save_shot(folder.path() / "shot.png", image, blobs);

  ASSERT_TRUE(saved) << saved.error().message;
  const auto read = cameras::read_grey_image(folder.path() / "shot.png");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->pixels.size(), pixels.size());
  const auto grey_at = [&](int x, int y) {
    return std::to_integer<int>(read->pixels[static_cast<std::size_t>(y * 40 + x)]);
  };
  EXPECT_EQ(grey_at(10, 12), 7);    // inside the box
  EXPECT_GT(grey_at(6, 12), 100);   // the left edge, 4 px from the centroid
  EXPECT_GT(grey_at(10, 16), 100);  // the lower edge
  EXPECT_GT(grey_at(16, 16), 100);  // the lower left corner of the index 0
  EXPECT_EQ(grey_at(17, 15), 7);    // its hole
  EXPECT_EQ(grey_at(25, 25), 7);
}

TEST(Shot, RefusesAnotherFormat) {
  const std::vector<std::byte> pixels(12);
  const Image image{pixels, 4, 4, 3, PixelFormat::Mono8};

  const Status saved = save_shot("/tmp/shot.jpg", image, {});

  ASSERT_FALSE(saved);
  EXPECT_THAT(saved.error().message, testing::HasSubstr("ends in .png"));
}

}  // namespace shot_test
}  // namespace mocap::ctl
