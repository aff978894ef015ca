#pragma once

#include <cstddef>
#include <functional>

#include "base/result.h"
#include "model/calibration/calibration_image.h"
#include "model/calibration/calibration_markers.h"
#include "model/calibration/calibration_order.h"
#include "model/calibration/calibration_report.h"

namespace mocap {

/// Receives the step in progress and the fraction of it that is done. Returning false cancels the solution.
using CalibrationProgress = std::function<bool(const char* step, double fraction)>;

/// Computes a rig from images of a waved wand, or its world frame from markers on the floor.
///
/// One thread makes all calls.
class RigCalibrator {
 public:
  virtual ~RigCalibrator() = default;

  /// Starts a collection, or starts it anew. Fails with InvalidArgument if the order cannot be followed: its wand is no
  /// wand, or the lens of a camera is not known.
  virtual Status start(const CalibrationOrder& order) = 0;

  /// Adds an image of the collection. The images of one camera come in the order of their exposure. Returns whether
  /// more images are welcome.
  virtual bool add(std::size_t camera, const CalibrationImage& image) = 0;

  /// Adds the markers of an instant to the collection. Returns whether more are welcome.
  virtual bool add(const CalibrationMarkers& markers) = 0;

  /// Ends the collection and computes the rig. The report has the result, or the reason why there is none.
  virtual void solve(const CalibrationProgress& progress) = 0;

  /// The state, the progress and the result.
  virtual CalibrationReport report() const = 0;
};

}  // namespace mocap
