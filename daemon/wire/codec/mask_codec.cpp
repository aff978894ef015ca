#include "wire/codec/mask_codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "wire/codec/utf8.h"

namespace mocap::wire {
namespace {

constexpr std::uint32_t kLeastImages = 10, kMostImages = 10000;
constexpr int kMostPolygons = 64, kLeastCorners = 3, kMostCorners = 1024;  // of all polygons together
constexpr double kFarthestCorner_px = 1e6;                                 // as in a rig file

Error wrong_mask(std::string what) { return {ErrorCode::InvalidArgument, "mask: " + std::move(what)}; }

Result<MaskPolygon> polygon_of(const v1::MaskPolygon& from, int number) {
  if (from.x_px_size() != from.y_px_size() || from.x_px_size() < kLeastCorners) {
    return wrong_mask(fmt::format("polygon {} has {} x_px and {} y_px, expected equal numbers of at least {}", number,
                                  from.x_px_size(), from.y_px_size(), kLeastCorners));
  }
  MaskPolygon into;
  for (int i = 0; i < from.x_px_size(); ++i) {
    for (const double value : {from.x_px(i), from.y_px(i)}) {
      // Written so that NaN is rejected.
      if (value >= -kFarthestCorner_px && value <= kFarthestCorner_px) continue;
      return wrong_mask(fmt::format("polygon {} has {} px as a coordinate, expected {} to {}", number, value,
                                    -kFarthestCorner_px, kFarthestCorner_px));
    }
    into.push_back({{from.x_px(i), from.y_px(i)}});
  }
  return into;
}

Result<std::vector<MaskPolygon>> polygons_of(const v1::MaskRequest& from) {
  int corners = 0;
  for (const v1::MaskPolygon& polygon : from.polygons()) corners += std::min(polygon.x_px_size(), kMostCorners + 1);
  if (from.polygons_size() > kMostPolygons || corners > kMostCorners) {
    return wrong_mask(fmt::format("{} polygons with {} corners, expected at most {} with {}", from.polygons_size(),
                                  corners, kMostPolygons, kMostCorners));
  }
  std::vector<MaskPolygon> all;
  for (int i = 0; i < from.polygons_size(); ++i) {
    Result<MaskPolygon> polygon = polygon_of(from.polygons(i), i + 1);
    if (!polygon) return polygon.error();
    all.push_back(*std::move(polygon));
  }
  return all;
}

void encode_polygons(const std::vector<MaskPolygon>& from, google::protobuf::RepeatedPtrField<v1::MaskPolygon>& into) {
  for (const MaskPolygon& polygon : from) {
    v1::MaskPolygon& to = *into.Add();
    for (const PixelPoint& corner : polygon) {
      to.add_x_px(corner.v.x());
      to.add_y_px(corner.v.y());
    }
  }
}

v1::MaskRequest::Action mask_action_of(ControlAction action) {
  switch (action) {
    case ControlAction::GetMasks: return v1::MaskRequest::ACTION_LIST;
    case ControlAction::DrawMasks: return v1::MaskRequest::ACTION_DRAW;
    case ControlAction::UndoMasks: return v1::MaskRequest::ACTION_UNDO;
    case ControlAction::ForgetMasks: return v1::MaskRequest::ACTION_FORGET;
    default: return v1::MaskRequest::ACTION_LEARN;
  }
}

Result<ControlRequest> of_one_camera(ControlAction action, const v1::MaskRequest& from) {
  if (from.camera().empty()) return wrong_mask("camera is missing, expected the name of a camera");
  ControlRequest into;
  into.action = action;
  into.name = from.camera();
  return into;
}

Result<ControlRequest> decode_learn(const v1::MaskRequest& from) {
  ControlRequest into;
  into.action = ControlAction::LearnMask;
  into.name = from.camera();
  into.images = from.images();
  if (into.images != 0 && (into.images < kLeastImages || into.images > kMostImages)) {
    return wrong_mask(fmt::format("images is {}, expected {} to {}", into.images, kLeastImages, kMostImages));
  }
  return into;
}

}  // namespace

Result<ControlRequest> decode(const v1::MaskRequest& from) {
  switch (from.action()) {
    case v1::MaskRequest::ACTION_UNSPECIFIED:
    case v1::MaskRequest::ACTION_LEARN: return decode_learn(from);
    case v1::MaskRequest::ACTION_UNDO: return of_one_camera(ControlAction::UndoMasks, from);
    case v1::MaskRequest::ACTION_FORGET: return of_one_camera(ControlAction::ForgetMasks, from);
    case v1::MaskRequest::ACTION_LIST: {
      ControlRequest into;
      into.action = ControlAction::GetMasks;
      into.name = from.camera();
      return into;
    }
    case v1::MaskRequest::ACTION_DRAW: {
      Result<ControlRequest> into = of_one_camera(ControlAction::DrawMasks, from);
      if (!into) return into;
      Result<std::vector<MaskPolygon>> polygons = polygons_of(from);
      if (!polygons) return polygons.error();
      into->polygons = *std::move(polygons);
      return into;
    }
    default: return wrong_mask("the action is unknown, expected learn, list, draw, undo or forget");
  }
}

v1::MaskRequest encode_mask_request(const ControlRequest& from) {
  v1::MaskRequest into;
  into.set_action(mask_action_of(from.action));
  into.set_camera(valid_utf8(from.name));
  into.set_images(from.images);
  encode_polygons(from.polygons, *into.mutable_polygons());
  return into;
}

v1::MaskList encode(const std::vector<CameraMasks>& from) {
  v1::MaskList into;
  for (const CameraMasks& masks : from) {
    v1::CameraMasks& to = *into.add_cameras();
    to.set_camera(valid_utf8(masks.camera));
    to.set_width_px(static_cast<std::uint32_t>(std::max(0, masks.width_px)));
    to.set_height_px(static_cast<std::uint32_t>(std::max(0, masks.height_px)));
    encode_polygons(masks.drawn, *to.mutable_drawn());
    encode_polygons(masks.learnt, *to.mutable_learnt());
    to.set_undo_steps(static_cast<std::uint32_t>(masks.undo_steps));
  }
  return into;
}

}  // namespace mocap::wire
