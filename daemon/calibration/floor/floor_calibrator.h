#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/floor/stationary_markers.h"
#include "module/rig_calibrator.h"

namespace mocap::calibration {

/// Measures the floor with the markers that the running daemon sees with the rig in force: markers that lie still for 5
/// s, or a walk of 30 s. The times are those of the exposures.
class FloorCalibrator : public RigCalibrator {
 public:
  /// `rig`: the cameras of the daemon.
  explicit FloorCalibrator(Rig rig) : rig_(std::move(rig)) {}

  /// Fails with InvalidArgument if a camera is not calibrated.
  Status start(const CalibrationOrder& order) override;
  bool add(std::size_t /*camera*/, const CalibrationImage& /*image*/) override { return false; }
  bool add(const CalibrationMarkers& markers) override;
  void solve(const CalibrationProgress& progress) override;
  CalibrationReport report() const override;

 private:
  void add_to_walk(const CalibrationMarkers& markers);
  std::string advice() const;

  Rig rig_;
  FloorOrder order_;
  CalibrationState state_ = CalibrationState::Idle;
  std::string message_;
  std::optional<Timestamp> begun_;
  Duration collected_{};
  StationaryMarkers stationary_;
  std::vector<Eigen::Vector3d> walk_m_;  // every walk_step_-th position
  std::size_t walk_step_ = 1;
  std::size_t walk_count_ = 0;
  std::optional<CalibrationResult> result_;
};

}  // namespace mocap::calibration
