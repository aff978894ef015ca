#pragma once

#include <cstdint>
#include <vector>

#include "scene/random.h"

namespace mocap::simworld {

enum class Visibility {
  Perfect,   ///< a camera sees each light inside its image
  Measured,  ///< occlusions as frequent and as long as in recordings of real cameras
};

/// Random visibility of each light in each camera, with the statistics of the camera masks in real recordings: a camera
/// sees a marker 63 % of the time (3.6 to 4.6 of 6 to 7 cameras), and a hidden marker stays hidden for 4 frames at 100
/// Hz in the median and 80 frames at the 90th percentile. Cameras are independent.
class VisibilityModel {
 public:
  VisibilityModel(Visibility kind, std::size_t cameras, std::size_t lights, std::uint64_t seed);

  /// Advances the time by `dt_s`.
  void advance(double dt_s);

  bool sees(std::size_t camera, std::size_t light) const;

 private:
  struct State {
    bool visible = true;
    double left_s = 0.0;  ///< time until `visible` changes
  };

  double hidden_s();
  double visible_s();

  Visibility kind_;
  std::size_t lights_;
  scene::Random random_;
  double mean_visible_s_ = 0.0;
  std::vector<State> states_;
};

}  // namespace mocap::simworld
