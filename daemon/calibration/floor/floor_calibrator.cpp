#include "calibration/floor/floor_calibrator.h"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/floor/floor.h"
#include "calibration/floor/measure_floor.h"
#include "model/calibration/calibrated_camera.h"

namespace mocap::calibration {
namespace {

constexpr Duration kStill = std::chrono::seconds(5);
constexpr Duration kWalk = std::chrono::seconds(30);

Duration length_of(FloorMethod method) { return method == FloorMethod::Walk ? kWalk : kStill; }

}  // namespace

Status FloorCalibrator::start(const CalibrationOrder& order) {
  const auto unknown = std::ranges::find_if_not(rig_, is_calibrated);
  if (unknown != rig_.end()) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("camera '{}' is not in the rig: calibrate the cameras with a wand first", unknown->name)};
  }
  order_ = order.floor;
  message_.clear();
  begun_.reset();
  collected_ = {};
  stationary_ = {};
  walk_ = {};
  result_.reset();
  state_ = CalibrationState::Collecting;
  return {};
}

bool FloorCalibrator::add(const CalibrationMarkers& markers) {
  if (state_ != CalibrationState::Collecting) return false;
  if (!begun_) begun_ = markers.exposed_at;
  collected_ = std::max(collected_, markers.exposed_at - *begun_);
  if (order_.method == FloorMethod::Walk) {
    for (const CalibrationMarker& marker : markers.markers) walk_.add(marker.at.v, marker.cameras);
  } else {
    stationary_.begin(markers.exposed_at);
    for (const CalibrationMarker& marker : markers.markers) stationary_.add(marker.track, marker.at.v);
  }
  return collected_ < length_of(order_.method);
}

void FloorCalibrator::solve(const CalibrationProgress& /*progress*/) {
  const std::vector<Eigen::Vector3d> points_m =
      order_.method == FloorMethod::Walk ? walk_.positions() : stationary_.positions();
  const Result<Floor> floor = measure_floor(order_, points_m, rig_);
  if (!floor) {
    state_ = CalibrationState::Failed;
    message_ = floor.error().message;
    return;
  }
  result_.emplace();
  result_->calibrated = {in_world(*floor, rig_), {{"floor", std::string(name_of(order_.method))}}};
  if (floor->is_checked) {
    result_->floor_rms_m = floor->rms_m;
    result_->calibrated.facts["floor_rms_mm"] = 1e3 * floor->rms_m;
  } else {
    result_->issues.emplace_back("the floor is not checked: three markers always fit; lay a fourth one");
  }
  state_ = CalibrationState::Solved;
}

std::string FloorCalibrator::advice() const {
  const char* what = order_.method == FloorMethod::Walk    ? "walk through the whole volume"
                     : order_.method == FloorMethod::Frame ? "leave the floor frame still"
                                                           : "leave the markers on the floor still";
  return fmt::format("{}: {:.0f} of {:.0f} s", what, to_s(collected_), to_s(length_of(order_.method)));
}

CalibrationReport FloorCalibrator::report() const {
  CalibrationReport report;
  report.state = state_;
  report.is_floor = true;
  report.message = message_;
  if (state_ == CalibrationState::Collecting) report.advice = advice();
  report.result = result_;
  return report;
}

}  // namespace mocap::calibration
