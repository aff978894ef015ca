#include "lib/cli/floor_options.h"

namespace mocap::cli {

void add_floor_options(App& app, FloorOptions& options) {
  auto* frame =
      app.add_option("--frame", options.frame_mm,
                     "length of the long arm (along x) and of the short arm (along y), mm; the corner is the origin")
          ->delimiter(',')
          ->expected(2)
          ->check(Range(50.0, 10000.0))
          ->capture_default_str();
  auto* markers = app.add_flag("--markers", options.by_markers,
                               "three markers or more on the floor instead of a frame; they do not determine the axes")
                      ->excludes(frame);
  app.add_flag("--walk", options.by_walk, "the lowest markers of a person who walks through the volume")
      ->excludes(frame)
      ->excludes(markers);
  app.add_option("--height", options.height_mm, "height of the centres of the (lowest) markers above the floor, mm")
      ->check(Range(-100.0, 1000.0))
      ->capture_default_str();
}

FloorOrder floor_order(const FloorOptions& options) {
  FloorOrder order;
  if (options.by_markers) order.method = FloorMethod::Points;
  if (options.by_walk) order.method = FloorMethod::Walk;
  order.long_m = 1e-3 * options.frame_mm[0];
  order.short_m = 1e-3 * options.frame_mm[1];
  order.height_m = 1e-3 * options.height_mm;
  return order;
}

}  // namespace mocap::cli
