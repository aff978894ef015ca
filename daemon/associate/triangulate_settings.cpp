#include "associate/triangulate_settings.h"

namespace mocap::associate {

void declare_keys(KeyVisitor& keys, TriangulateSettings& triangulate) {
  keys.number("calibration_px", triangulate.calibration_px, {0, 20},
              {.help = "largest standard deviation of the rig error, used until the observed one is known"});
  keys.number("agree_sigmas", triangulate.agree_sigmas, {1, 10},
              {.help = "a view that is further off is an outlier and is left out"});
  keys.millimetres("max_sigma_mm", triangulate.max_sigma_m, {0.01, 1000},
                   {.help = "a point with a larger standard deviation in its worst direction is dropped"});
}

}  // namespace mocap::associate
