#pragma once

#include <cstdint>
#include <vector>

#include "scene/random.h"

namespace mocap::simworld {

enum class Visibility {
  Perfect,   ///< every camera sees what lies in its image
  Measured,  ///< hidden as often and as long as markers are from real cameras
};

/// Which camera sees which light: as camera masks of real recordings tell it. There, a camera sees a marker 63 % of the
/// time (3.6 to 4.6 of 6 to 7 cameras); once hidden it stays so for 4 frames of 100 Hz in the median, 80 at the 90th
/// percentile. Cameras are hidden independently of each other.
class VisibilityModel {
 public:
  VisibilityModel(Visibility kind, std::size_t cameras, std::size_t lights, std::uint64_t seed);

  /// Goes on by `dt_s`.
  void advance(double dt_s);

  bool sees(std::size_t camera, std::size_t light) const;

 private:
  struct State {
    bool visible = true;
    double left_s = 0.0;  ///< until it changes
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
