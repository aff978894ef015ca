#include "solve/solve_settings.h"

namespace mocap::solve {

void declare_keys(KeyVisitor& keys, SolveSettings& solve) {
  keys.millimetres("marker_sigma_mm", solve.marker_sigma_m, {0.1, 100},
                   {.help = "standard deviation of a marker's place on its bone: skin, suit"});
  keys.millimetres("outlier_mm", solve.outlier_m, {1, 1000},
                   {.help = "a marker further from its place has nearly no weight"});
  keys.number("fill_for_s", solve.fill_for_s, {0, 60},
              {.help = "how long a marker that no camera sees is predicted from the body"});
  keys.number("max_iterations", solve.max_iterations, {1, 100},
              {.help = "in each set; a first pose has up to 15 times as many"});
  declare_keys(keys, solve.smoothing);
}

}  // namespace mocap::solve
