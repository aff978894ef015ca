#pragma once

#include <vector>

#include "calibration/bundle.h"
#include "calibration/wand/wand_views.h"

namespace mocap::calibration {

/// How long after the others a camera takes its pictures, as far as their time stamps do not say so.
struct TimeOffset {
  double late_s = 0.0;
  double sigma_s = 0.0;  ///< infinite where the wand's motion does not tell
};

/// By camera: its spots lie along the wand's motion from where the other cameras put the wand. Needs places in the
/// bundle's frame that are right to `gate_px`.
std::vector<TimeOffset> time_offsets(const WandViews& views, const Bundle& bundle, double gate_px);

}  // namespace mocap::calibration
