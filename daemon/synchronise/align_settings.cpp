#include "synchronise/align_settings.h"

namespace mocap::synchronise {

void declare_keys(KeyVisitor& keys, AlignSettings& align) {
  keys.time("window_us", align.window, {1, 1e6},
            {.help = "exposures further apart belong to different sets; less than half a frame period"});
  keys.time(
      "patience_us", align.patience, {0, 1e7},
      {.help = "how long the first image of a set waits for the last; delays a set only if an image is late, and a few "
               "sets after a camera stops; longer: fewer incomplete sets on a busy host"});
}

}  // namespace mocap::synchronise
