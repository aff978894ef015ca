#include "wire/codec/calibration_codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "wire/codec/utf8.h"

namespace mocap::wire {
namespace {

constexpr double kNarrowest_deg = 5.0, kWidest_deg = 150.0;  // as mocap-calibrate wand --fov
constexpr double kLongestWand_m = 10.0;
constexpr double kShortestArm_m = 0.05, kLongestArm_m = 10.0;     // as mocap-calibrate floor --frame
constexpr double kLowestMarker_m = -0.1, kHighestMarker_m = 1.0;  // as mocap-calibrate floor --height
constexpr int kMostMarkers = 3;
constexpr std::size_t kLongestRigName = 255;

Error wrong_calibration(std::string what) { return {ErrorCode::InvalidArgument, std::move(what)}; }

std::optional<CalibrationAction> order_action_of(v1::CalibrationRequest::Action action) {
  switch (action) {
    case v1::CalibrationRequest::ACTION_STATUS: return CalibrationAction::Look;
    case v1::CalibrationRequest::ACTION_LIST: return CalibrationAction::List;
    case v1::CalibrationRequest::ACTION_WAND: return CalibrationAction::Wand;
    case v1::CalibrationRequest::ACTION_SOLVE: return CalibrationAction::Solve;
    case v1::CalibrationRequest::ACTION_APPLY: return CalibrationAction::Apply;
    case v1::CalibrationRequest::ACTION_CANCEL: return CalibrationAction::Cancel;
    case v1::CalibrationRequest::ACTION_RESTORE: return CalibrationAction::Restore;
    case v1::CalibrationRequest::ACTION_FLOOR: return CalibrationAction::Floor;
    default: return std::nullopt;
  }
}

v1::CalibrationRequest::Action wire_action_of(CalibrationAction action) {
  switch (action) {
    case CalibrationAction::Look: return v1::CalibrationRequest::ACTION_STATUS;
    case CalibrationAction::List: return v1::CalibrationRequest::ACTION_LIST;
    case CalibrationAction::Wand: return v1::CalibrationRequest::ACTION_WAND;
    case CalibrationAction::Solve: return v1::CalibrationRequest::ACTION_SOLVE;
    case CalibrationAction::Apply: return v1::CalibrationRequest::ACTION_APPLY;
    case CalibrationAction::Cancel: return v1::CalibrationRequest::ACTION_CANCEL;
    case CalibrationAction::Restore: return v1::CalibrationRequest::ACTION_RESTORE;
    case CalibrationAction::Floor: return v1::CalibrationRequest::ACTION_FLOOR;
  }
  return v1::CalibrationRequest::ACTION_UNSPECIFIED;
}

v1::CalibrationState wire_state_of(CalibrationState state) {
  switch (state) {
    case CalibrationState::Idle: return v1::CALIBRATION_STATE_IDLE;
    case CalibrationState::Collecting: return v1::CALIBRATION_STATE_COLLECTING;
    case CalibrationState::Solving: return v1::CALIBRATION_STATE_SOLVING;
    case CalibrationState::Solved: return v1::CALIBRATION_STATE_SOLVED;
    case CalibrationState::Applied: return v1::CALIBRATION_STATE_APPLIED;
    case CalibrationState::Failed: return v1::CALIBRATION_STATE_FAILED;
    case CalibrationState::Cancelled: return v1::CALIBRATION_STATE_CANCELLED;
  }
  return v1::CALIBRATION_STATE_UNSPECIFIED;
}

FloorMethod floor_method_of(v1::FloorRequest::Method method) {
  switch (method) {
    case v1::FloorRequest::METHOD_MARKERS: return FloorMethod::Points;
    case v1::FloorRequest::METHOD_WALK: return FloorMethod::Walk;
    default: return FloorMethod::Frame;
  }
}

v1::FloorRequest::Method wire_method_of(FloorMethod method) {
  switch (method) {
    case FloorMethod::Points: return v1::FloorRequest::METHOD_MARKERS;
    case FloorMethod::Walk: return v1::FloorRequest::METHOD_WALK;
    case FloorMethod::Frame: break;
  }
  return v1::FloorRequest::METHOD_FRAME;
}

// Each comparison is written so that NaN is rejected.
bool is_within(double value, double lowest, double highest) { return value >= lowest && value <= highest; }

Result<FloorOrder> decode_floor(const v1::FloorRequest& from) {
  FloorOrder into;
  into.method = floor_method_of(from.method());
  if (from.long_m() != 0.0) into.long_m = from.long_m();
  if (from.short_m() != 0.0) into.short_m = from.short_m();
  into.height_m = from.height_m();
  for (const auto& [name, arm_m] : {std::pair{"long_m", into.long_m}, std::pair{"short_m", into.short_m}}) {
    if (!is_within(arm_m, kShortestArm_m, kLongestArm_m)) {
      return wrong_calibration(
          fmt::format("floor: {} is {}, expected {} to {} m", name, arm_m, kShortestArm_m, kLongestArm_m));
    }
  }
  if (!is_within(into.height_m, kLowestMarker_m, kHighestMarker_m)) {
    return wrong_calibration(
        fmt::format("floor: height_m is {}, expected {} to {} m", into.height_m, kLowestMarker_m, kHighestMarker_m));
  }
  return into;
}

bool is_position(double mark_m) { return mark_m >= 0.0 && mark_m <= kLongestWand_m; }

void encode_camera(const CalibrationCamera& from, v1::CalibrationCamera& into) {
  into.set_name(valid_utf8(from.name));
  into.set_images(from.images);
  into.set_dropped(from.dropped);
  into.set_samples(from.samples);
  into.set_shared(from.shared);
  into.set_coverage(from.coverage);
  for (const std::uint32_t count : from.cells) into.add_cells(count);
  into.set_connected(from.is_connected);
  into.set_rms_px(from.rms_px);
  into.set_heldout_px(from.heldout_px.value_or(0.0));  // here and below, 0 is unknown: control.proto
  into.set_points(from.points);
  into.set_position_sigma_m(from.position_sigma_m.value_or(0.0));
  into.set_rotation_sigma_rad(from.rotation_sigma_rad.value_or(0.0));
}

void encode_result(const CalibrationResult& from, v1::CalibrationResult& into) {
  into.set_grade(from.grade);
  into.set_rms_px(from.rms_px);
  into.set_heldout_px(from.heldout_px.value_or(0.0));
  into.set_samples(from.samples);
  into.set_wand_m(from.wand_m);
  into.set_wand_std_m(from.wand_std_m);
  into.set_floor_is_guessed(from.floor_is_guessed);
  for (const std::string& issue : from.issues) into.add_issues(valid_utf8(issue));
  if (from.floor_rms_m) into.set_floor_rms_m(*from.floor_rms_m);
}

}  // namespace

Result<CalibrationOrder> decode(const v1::CalibrationRequest& from) {
  CalibrationOrder into;
  const std::optional<CalibrationAction> action = order_action_of(from.action());
  if (!action) {
    return wrong_calibration(
        "calibration: action is missing, expected status, list, wand, floor, solve, apply, cancel or restore");
  }
  into.action = *action;
  if (from.name().size() > kLongestRigName) {
    return wrong_calibration(
        fmt::format("name has {} bytes, at most {} are allowed", from.name().size(), kLongestRigName));
  }
  if (into.action == CalibrationAction::Restore && from.name().empty()) {
    return wrong_calibration("calibration: name is missing, expected the name of an earlier rig");
  }
  into.name = from.name();
  if (into.action == CalibrationAction::Floor) {
    const Result<FloorOrder> floor = decode_floor(from.floor());
    if (!floor) return floor.error();
    into.floor = *floor;
  }
  if (into.action != CalibrationAction::Wand) return into;
  if (from.wand_m_size() > kMostMarkers || !std::ranges::all_of(from.wand_m(), is_position)) {
    return wrong_calibration(fmt::format("wand_m has {} numbers, expected 2 or {} from 0 to {} m", from.wand_m_size(),
                                         kMostMarkers, kLongestWand_m));
  }
  into.wand_m.assign(from.wand_m().begin(), from.wand_m().end());
  if (from.has_fov_deg()) {
    if (!is_within(from.fov_deg(), kNarrowest_deg, kWidest_deg)) {
      return wrong_calibration(
          fmt::format("fov_deg is {}, expected {} to {}", from.fov_deg(), kNarrowest_deg, kWidest_deg));
    }
    into.fov_deg = from.fov_deg();
  }
  into.refine_lens = from.refine_lens();
  into.moved = from.moved();
  return into;
}

v1::CalibrationRequest encode(const CalibrationOrder& from) {
  v1::CalibrationRequest into;
  into.set_action(wire_action_of(from.action));
  for (const double mark : from.wand_m) into.add_wand_m(mark);
  if (from.fov_deg) into.set_fov_deg(*from.fov_deg);
  into.set_refine_lens(from.refine_lens);
  into.set_moved(from.moved);
  into.set_name(valid_utf8(from.name));
  if (from.action != CalibrationAction::Floor) return into;
  v1::FloorRequest& floor = *into.mutable_floor();
  floor.set_method(wire_method_of(from.floor.method));
  floor.set_long_m(from.floor.long_m);
  floor.set_short_m(from.floor.short_m);
  floor.set_height_m(from.floor.height_m);
  return into;
}

v1::Calibration encode(const CalibrationReport& from) {
  v1::Calibration into;
  into.set_state(wire_state_of(from.state));
  into.set_complete(from.is_complete);
  into.set_floor(from.is_floor);
  into.set_advice(valid_utf8(from.advice));
  into.set_min_shared(from.min_shared);
  into.set_step(valid_utf8(from.step));
  into.set_fraction(from.fraction);
  into.set_message(valid_utf8(from.message));
  for (const CalibrationCamera& camera : from.cameras) encode_camera(camera, *into.add_cameras());
  if (from.result) encode_result(*from.result, *into.mutable_result());
  return into;
}

v1::RigList encode(const std::vector<KeptRig>& from) {
  v1::RigList into;
  for (const KeptRig& rig : from) {
    v1::KeptRig& to = *into.add_rigs();
    to.set_name(valid_utf8(rig.name));
    to.set_solved_at_utc(valid_utf8(rig.solved_at_utc));
    to.set_solved_by(valid_utf8(rig.solved_by));
    to.set_cameras(rig.cameras);
    to.set_rms_px(rig.rms_px);
    to.set_in_force(rig.in_force);
  }
  return into;
}

}  // namespace mocap::wire
