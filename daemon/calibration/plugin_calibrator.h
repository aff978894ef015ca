#pragma once

#include <cstddef>
#include <memory>
#include <utility>

#include "calibration/wand/rig_before.h"
#include "module/rig_calibrator.h"

namespace mocap::calibration {

/// The function `mocap_make_calibrator` of the plug-in mocap_calibration.so
/// (daemon/calibration/plugin/wand_plugin.cpp). The plug-in and its user are built together.
using MakeCalibrator = RigCalibrator*(const RigBefore& known, int threads);

/// A WandCalibrator in the plug-in mocap_calibration.so, which the first collection loads. The solver is a plug-in
/// because it depends on OpenCV and Ceres, and most daemons never calibrate.
class PluginCalibrator : public RigCalibrator {
 public:
  /// `known`: the cameras of the daemon. `threads`: of the solution.
  PluginCalibrator(RigBefore known, int threads) : known_(std::move(known)), threads_(threads) {}

  /// Fails also with Unsupported if the plug-in is not installed.
  Status start(const CalibrationOrder& order) override;
  bool add(std::size_t camera, const CalibrationImage& image) override;
  bool add(const CalibrationMarkers& /*markers*/) override { return false; }
  void solve(const CalibrationProgress& progress) override;
  CalibrationReport report() const override;

 private:
  RigBefore known_;
  int threads_;
  std::unique_ptr<RigCalibrator> loaded_;  // null before the first collection
};

}  // namespace mocap::calibration
