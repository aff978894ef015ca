#include "pose/smooth_settings.h"

namespace mocap::pose {

void declare_keys(KeyVisitor& keys, SmoothSettings& smooth) {
  keys.note(
      "Jitter: a 1-euro low-pass filter on the root's position and the joint rotations. It delays poses by 1 / (2 pi "
      "f), "
      "f = smoothing_min_cutoff_hz + smoothing_beta * speed (m/s, rad/s): with 2 and 0.5 by 80 ms at rest and 35 ms at "
      "5 rad/s. The present delay is published with each pose (smoothing_delay_s).");
  keys.number("smoothing_min_cutoff_hz", smooth.min_cutoff_hz, {0, 100},
              {.help = "cutoff frequency at rest; 0: no smoothing, no delay"});
  keys.number("smoothing_beta", smooth.beta, {0, 100}, {.help = "rise of f in Hz for each m/s or rad/s"});
}

}  // namespace mocap::pose
