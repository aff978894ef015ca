#pragma once

#include <optional>
#include <vector>

#include "calibration/wand/instants.h"
#include "calibration/wand/relate.h"
#include "calibration/wand/solve_wand.h"

namespace mocap::calibration {

/// The wand in one camera at one instant.
struct WandView {
  WandSpots spots{-1, -1, -1};
  WandRays rays;
};

/// A take in which the wand was looked for in each picture. The take outlives it.
struct WandViews {
  const Take* take = nullptr;
  std::vector<Instant> instants;
  std::vector<std::vector<std::optional<WandView>>> of;  ///< by camera, by instant

  const Picture* picture(std::size_t camera, std::size_t instant) const;
};

/// Looks for the wand in all pictures, and refuses takes that cannot give a rig. Rays are by the lenses of `rig`.
Result<WandViews, WandRefusal> look_for_wand(const Take& take, const Rig& rig, const Wand& wand,
                                             const WandSettings& settings);

}  // namespace mocap::calibration
