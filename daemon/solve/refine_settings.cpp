#include "solve/refine_settings.h"

namespace mocap::solve {

void declare_keys(KeyVisitor& keys, RefineSettings& refine) {
  keys.number("instants", refine.instants, {0, 200},
              {.help = "number of most different poses to which bones and markers are fitted; 0: no refinement"});
  keys.time("look_every_ms", refine.look_every, {1, 10000}, {.help = "time between two poses that are considered"});
  keys.number("pieces", refine.pieces, {1, 100},
              {.help = "pieces of work in each set, about 25 us each for 41 markers"});
  keys.number(
      "least_gain", refine.least_gain, {0, 1},
      {.help = "smallest relative reduction of the residual, on poses that the fit has not used, to accept a fit"});
}

}  // namespace mocap::solve
