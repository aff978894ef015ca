#include "take/recorder/edge_images.h"

#include <gtest/gtest.h>

#include "take/example_take.h"

namespace mocap::take {
namespace edge_images_test {

// A set at 1000 ms with an image 300 ms before and one 200 ms after.
v1::Snapshot spread_set() {
  v1::Snapshot set;
  set.mutable_instants()->set_exposed_at_ns(1'000'000'000);
  for (const std::uint32_t camera : {0U, 1U}) set.mutable_views()->add_cameras(camera);
  for (const std::int64_t skew_ns : {-300'000'000, 200'000'000}) set.mutable_views()->add_skews_ns(skew_ns);
  return set;
}

BufferedMessage image(std::uint32_t camera, std::int64_t at_ms) {
  return {BufferedKind::Blobs, camera, from_ns(at_ms * 1'000'000), "blobs"};
}

TEST(EdgeImages, AreTakenByTheSetThatNamesThem) {
  EdgeImages images;
  EXPECT_FALSE(images.add(image(0, 700)));
  EXPECT_FALSE(images.add(image(1, 700))) << "camera 1 has another exposure in the set";

  const std::vector<EdgeImages::Image>& taken = images.take(spread_set());

  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].camera, 0U);
  EXPECT_EQ(taken[0].bytes, "blobs");
  EXPECT_FALSE(images.empty()) << "the other one waits on";
}

TEST(EdgeImages, MayComeAfterTheSnapshotOfTheirSet) {
  EdgeImages images;
  EXPECT_TRUE(images.take(spread_set()).empty());

  EXPECT_TRUE(images.add(image(1, 1200)));
  EXPECT_FALSE(images.add(image(1, 1200))) << "once";
}

TEST(EdgeImages, OfEarlierSetsAreForgotten) {
  EdgeImages images;
  EXPECT_FALSE(images.add(image(0, 700)));

  images.forget(from_ns(700'000'000));

  EXPECT_TRUE(images.empty());
  EXPECT_TRUE(images.take(spread_set()).empty());
}

}  // namespace edge_images_test
}  // namespace mocap::take
