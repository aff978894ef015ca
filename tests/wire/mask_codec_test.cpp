#include "wire/codec/mask_codec.h"

#include <gmock/gmock.h>

#include <limits>
#include <string>

#include "wire/codec/control_codec.h"

namespace mocap::wire {
namespace mask_codec_test {

using ::testing::HasSubstr;

v1::MaskRequest drawing(int polygons, int corners) {
  v1::MaskRequest request;
  request.set_action(v1::MaskRequest::ACTION_DRAW);
  request.set_camera("north");
  for (int i = 0; i < polygons; ++i) {
    v1::MaskPolygon& polygon = *request.add_polygons();
    for (int k = 0; k < corners; ++k) {
      polygon.add_x_px(10.0 * k);
      polygon.add_y_px(i + 0.5);
    }
  }
  return request;
}

TEST(MaskRequest, OfEachActionGoesThereAndBack) {
  for (const ControlAction action : {ControlAction::LearnMask, ControlAction::DrawMasks, ControlAction::UndoMasks,
                                     ControlAction::ForgetMasks, ControlAction::GetMasks}) {
    ControlRequest request;
    request.action = action;
    request.name = "north";
    if (action == ControlAction::LearnMask) request.images = 20;
    if (action == ControlAction::DrawMasks) request.polygons = {{{{1.5, 2.0}}, {{3.0, 2.0}}, {{-4.0, 9.0}}}};

    const auto back = decode(encode(request));

    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->action, action);
    EXPECT_EQ(back->name, "north");
    EXPECT_EQ(back->images, request.images);
    ASSERT_EQ(back->polygons.size(), request.polygons.size());
    if (!request.polygons.empty()) {
      EXPECT_EQ(back->polygons[0][2].v, Eigen::Vector2d(-4.0, 9.0));
    }
    EXPECT_EQ(only_looks(action), action == ControlAction::GetMasks);
  }
}

TEST(MaskRequest, WithoutAnActionLearnsAsBeforeThereWereActions) {
  const auto read = decode(v1::MaskRequest{});
  ASSERT_TRUE(read);
  EXPECT_EQ(read->action, ControlAction::LearnMask);
}

TEST(MaskRequest, OfOneCameraNeedsItsName) {
  for (const auto action :
       {v1::MaskRequest::ACTION_DRAW, v1::MaskRequest::ACTION_UNDO, v1::MaskRequest::ACTION_FORGET}) {
    v1::MaskRequest request;
    request.set_action(action);
    const auto read = decode(request);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, HasSubstr("camera is missing"));
  }
}

TEST(MaskRequest, IsRefusedIfAPolygonIsNone) {
  EXPECT_THAT(decode(drawing(1, 2)).error().message,
              HasSubstr("polygon 1 has 2 x_px and 2 y_px, expected equal numbers"));
  v1::MaskRequest uneven = drawing(2, 3);
  uneven.mutable_polygons(1)->add_x_px(1.0);
  EXPECT_THAT(decode(uneven).error().message, HasSubstr("polygon 2 has 4 x_px and 3 y_px"));
  for (const double wrong :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e7, -1e7}) {
    v1::MaskRequest far = drawing(1, 3);
    far.mutable_polygons(0)->set_y_px(1, wrong);
    EXPECT_THAT(decode(far).error().message, HasSubstr("as a coordinate, expected -1000000 to 1000000")) << wrong;
  }
}

TEST(MaskRequest, IsBounded) {
  EXPECT_TRUE(decode(drawing(64, 16)));
  EXPECT_THAT(decode(drawing(65, 3)).error().message,
              HasSubstr("65 polygons with 195 corners, expected at most 64 with 1024"));
  EXPECT_THAT(decode(drawing(1, 1025)).error().message, HasSubstr("1 polygons with 1025 corners"));
}

TEST(MaskList, HasTheMasksOfBothKinds) {
  const v1::MaskList list = encode(std::vector<CameraMasks>{{"north",
                                                             640,
                                                             480,
                                                             {{{{1.0, 2.0}}, {{3.0, 2.0}}, {{3.0, 4.0}}}},
                                                             {{{{5.0, 6.0}}, {{7.0, 6.0}}, {{7.0, 8.0}}}},
                                                             3}});

  ASSERT_EQ(list.cameras_size(), 1);
  const v1::CameraMasks& masks = list.cameras(0);
  EXPECT_EQ(masks.camera(), "north");
  EXPECT_EQ(masks.width_px(), 640U);
  EXPECT_EQ(masks.height_px(), 480U);
  EXPECT_THAT(masks.drawn(0).y_px(), ::testing::ElementsAre(2.0, 2.0, 4.0));
  EXPECT_THAT(masks.learnt(0).x_px(), ::testing::ElementsAre(5.0, 7.0, 7.0));
  EXPECT_EQ(masks.undo_steps(), 3U);
}

}  // namespace mask_codec_test
}  // namespace mocap::wire
