#pragma once

#include <string>
#include <vector>

#include "calibrate/lens_views.h"
#include "calibration/lens/fit_lens.h"

namespace mocap::calibrate {

/// The result of one camera.
struct LensOutcome {
  std::string name;
  std::size_t images = 0;
  std::size_t found = 0;
  int width_px = 0;
  int height_px = 0;
  calibration::LensCoverage coverage;
  Result<calibration::LensFit> fit;
};

/// Lines of text.
std::string lens_text(const LensOutcome& outcome);

/// One JSON object: `cameras.<name>.{rms_px,heldout_px,coverage,...}`, or `refused` with the reason.
std::string lens_json(const std::vector<LensOutcome>& outcomes);

}  // namespace mocap::calibrate
