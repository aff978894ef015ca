#pragma once

#include <memory>
#include <utility>

#include "module/rig_calibrator.h"

namespace mocap::calibration {

/// Passes each order to the calibrator that it is for: of the floor, or of the cameras.
class OrderCalibrator : public RigCalibrator {
 public:
  OrderCalibrator(std::unique_ptr<RigCalibrator> wand, std::unique_ptr<RigCalibrator> floor)
      : wand_(std::move(wand)), floor_(std::move(floor)) {}

  Status start(const CalibrationOrder& order) override {
    RigCalibrator* const meant = order.action == CalibrationAction::Floor ? floor_.get() : wand_.get();
    Status started = meant->start(order);
    if (started) chosen_ = meant;
    return started;
  }
  bool add(std::size_t camera, const CalibrationImage& image) override {
    return chosen_ != nullptr && chosen_->add(camera, image);
  }
  bool add(const CalibrationMarkers& markers) override { return chosen_ != nullptr && chosen_->add(markers); }
  void solve(const CalibrationProgress& progress) override {
    if (chosen_ != nullptr) chosen_->solve(progress);
  }
  CalibrationReport report() const override { return chosen_ != nullptr ? chosen_->report() : CalibrationReport{}; }

 private:
  std::unique_ptr<RigCalibrator> wand_, floor_;
  RigCalibrator* chosen_ = nullptr;  // of the last order that was followed
};

}  // namespace mocap::calibration
