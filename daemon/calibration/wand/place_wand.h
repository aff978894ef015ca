#pragma once

#include <cstddef>

#include "calibration/bundle.h"
#include "calibration/wand/wand_views.h"

namespace mocap::calibration {

struct PlaceSettings {
  double gate_px = 3.0;  ///< a spot may lie so far from where its marker should be
  std::size_t most_samples = 1000;
  int without = -1;  ///< a camera that has no say in where the wand was
};

/// Says anew where the wand was at each instant, by the bundle's cameras, and which spots are its markers: also in
/// pictures in which it could not be told by itself. Replaces places and sights.
void place_wand(const WandViews& views, Bundle& bundle, const PlaceSettings& settings);

/// Takes out sights that lie further off than their like (over 4.5 robust standard deviations), and places that two
/// cameras do not see any more. Gives how many sights went.
std::size_t drop_outliers(Bundle& bundle);

}  // namespace mocap::calibration
