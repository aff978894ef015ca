#include "ctl/live/mask_command.h"

#include <gmock/gmock.h>

namespace mocap::ctl {
namespace mask_command_test {

using ::testing::HasSubstr;

std::vector<double> corners_of(const MaskPolygon& polygon) {
  std::vector<double> all;
  for (const PixelPoint& corner : polygon) all.insert(all.end(), {corner.v.x(), corner.v.y()});
  return all;
}

TEST(MaskRectangle, IsBoundedByTheBordersOfItsPixels) {
  const auto polygon = rectangle_of("10,20,3,2");

  ASSERT_TRUE(polygon) << polygon.error().message;
  EXPECT_EQ(corners_of(*polygon), (std::vector<double>{9.5, 19.5, 12.5, 19.5, 12.5, 21.5, 9.5, 21.5}));
}

TEST(MaskPolygonText, HasItsCornersInOrder) {
  const auto polygon = polygon_of("0,0,200.5,-3,0,150");

  ASSERT_TRUE(polygon) << polygon.error().message;
  EXPECT_EQ(corners_of(*polygon), (std::vector<double>{0, 0, 200.5, -3, 0, 150}));
}

TEST(MaskTexts, ThatAreNoAreaAreRefusedWithWhatIsExpected) {
  for (const char* wrong :
       {"", "1,2,3", "1,2,3,4,5", "1,2,0,4", "1,2,3,x", "1,2,3,", "1;2;3;4", "1,2,nan,4", "1,2,3,4 "}) {
    const auto polygon = rectangle_of(wrong);
    ASSERT_FALSE(polygon) << wrong;
    EXPECT_THAT(polygon.error().message, HasSubstr("expected X,Y,W,H in pixels, W and H at least 1")) << wrong;
  }
  for (const char* wrong : {"", "1,2,3,4", "1,2,3,4,5,6,7", "1,2,3,4,5,inf"}) {
    const auto polygon = polygon_of(wrong);
    ASSERT_FALSE(polygon) << wrong;
    EXPECT_THAT(polygon.error().message, HasSubstr("expected X,Y,X,Y,X,Y in pixels")) << wrong;
  }
}

}  // namespace mask_command_test
}  // namespace mocap::ctl
