#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "calibration/floor/stationary_markers.h"
#include "calibration/floor/walk_positions.h"
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
  std::string advice() const;

  Rig rig_;
  FloorOrder order_;
  CalibrationState state_ = CalibrationState::Idle;
  std::string message_;
  std::optional<Timestamp> begun_;
  Duration collected_{};
  StationaryMarkers stationary_;
  WalkPositions walk_;
  std::optional<CalibrationResult> result_;
};

}  // namespace mocap::calibration
