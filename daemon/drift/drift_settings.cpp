#include "drift/drift_settings.h"

namespace mocap::drift {

void declare_keys(KeyVisitor& keys, DriftSettings& drift) {
  keys.number(
      "drift_px", drift.drift_px, {0, 100},
      {.help = "a camera is reported if a rotation and a translation of it explain a reprojection error of more than "
               "this, rms length; 0: off"});
  keys.number("reach_deg", drift.reach_deg, {0.1, 5}, {.help = "largest rotation by a bump that is looked for"});
  keys.number("memory_s", drift.memory_s, {0.5, 600}, {.help = "time constant by which older views lose weight"});
}

}  // namespace mocap::drift
