// mocap_calibration.so: computes rigs for the running daemon. See calibration/plugin_calibrator.h.
#include "calibration/plugin_calibrator.h"
#include "calibration/wand/wand_calibrator.h"

extern "C" __attribute__((visibility("default"))) mocap::RigCalibrator* mocap_make_calibrator(
    const mocap::calibration::RigBefore& known, int threads) {
  return new mocap::calibration::WandCalibrator(known, threads);
}
