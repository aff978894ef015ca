#include "calibration/floor/measure_floor.h"

#include <fmt/format.h>

#include <cmath>

#include "calibration/floor/floor_frame_scale.h"

namespace mocap::calibration {
namespace {

// Below this relative difference the size of the floor frame is not the reason for its refusal.
constexpr double kMinScaleError = 0.02;

Result<Floor> floor_by_frame(const FloorFrame& frame, std::span<const Eigen::Vector3d> points_m, const Rig& rig) {
  auto floor = floor_from_frame(points_m, frame, rig);
  if (floor) return floor;
  // A frame of the right shape and another size: the scale of the rig is wrong.
  const auto scale = floor_frame_scale(points_m, frame);
  if (!scale || std::abs(*scale - 1.0) <= kMinScaleError) return floor;
  return Error{ErrorCode::InvalidArgument,
               fmt::format("the floor frame is {:.3f} times as large as expected ({:.0f}, {:.0f} mm): the length of "
                           "the wand was set too {}, or the arms of the frame have other lengths; set their lengths",
                           *scale, 1e3 * frame.long_m, 1e3 * frame.short_m, *scale > 1.0 ? "large" : "small")};
}

}  // namespace

Result<Floor> measure_floor(const FloorOrder& order, std::span<const Eigen::Vector3d> points_m, const Rig& rig) {
  switch (order.method) {
    case FloorMethod::Walk: return floor_from_walk(points_m, order.height_m, rig);
    case FloorMethod::Points: return floor_from_points(points_m, order.height_m, rig);
    case FloorMethod::Frame: break;
  }
  return floor_by_frame({order.long_m, order.short_m, order.height_m}, points_m, rig);
}

const char* name_of(FloorMethod method) noexcept {
  switch (method) {
    case FloorMethod::Walk: return "walk";
    case FloorMethod::Points: return "markers";
    case FloorMethod::Frame: break;
  }
  return "frame";
}

}  // namespace mocap::calibration
