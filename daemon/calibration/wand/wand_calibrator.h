#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/wand/rig_before.h"
#include "calibration/wand/wand.h"
#include "calibration/wand/wand_progress.h"
#include "calibration/wand/wand_recording.h"
#include "module/rig_calibrator.h"

namespace mocap::calibration {

/// Calibrates all cameras with a waved wand, image by image: WandProgress while the images are collected, then
/// solve_wand. Keeps the images, at most 36000 of each camera.
class WandCalibrator : public RigCalibrator {
 public:
  /// `known`: the cameras of the daemon, with their lenses and poses if they are calibrated. `threads`: of the
  /// solution.
  WandCalibrator(RigBefore known, int threads);

  Status start(const CalibrationOrder& order) override;
  bool add(std::size_t camera, const CalibrationImage& image) override;
  bool add(const CalibrationMarkers& /*markers*/) override { return false; }
  void solve(const CalibrationProgress& progress) override;
  CalibrationReport report() const override;

 private:
  bool prepare(std::size_t camera, const CalibrationImage& image);
  void fail(CalibrationState state, std::string message);
  void describe_progress(CalibrationReport& report) const;

  RigBefore known_;
  int threads_;
  CalibrationOrder order_;
  Wand wand_;
  Rig start_;                             // known_, with approximate lenses where the field of view is used
  bool is_lens_known_ = true;             // it is used for no camera
  std::optional<WandProgress> progress_;  // nothing until every camera has delivered an image
  Take recording_;
  CalibrationState state_ = CalibrationState::Idle;
  std::string message_;
  std::vector<CalibrationCamera> solved_cameras_;  // figures of the result, by camera
  std::optional<CalibrationResult> result_;
};

}  // namespace mocap::calibration
