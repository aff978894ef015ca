#include "associate/match_settings.h"

#include "model/bounds.h"

namespace mocap::associate {

void declare_keys(KeyVisitor& keys, MatchSettings& match) {
  constexpr KeyRange kPlace_m{-1000, 1000};
  keys.number("gate_sigmas", match.gate_sigmas, {1, 10},
              {.help = "radius of the gate of a predicted marker in standard deviations"});
  keys.number("gate_floor_px", match.gate_floor_px, {0, 100},
              {.help = "standard deviation added to those of prediction and blob"});
  keys.number(
      "calibration_px", match.calibration_px, {0, 20},
      {.help = "standard deviation of the rig error; predicted markers use the observed error instead, if it is "
               "smaller"});
  keys.number("agree_sigmas", match.agree_sigmas, {1, 10},
              {.help = "largest distance of a view from the common point of a marker's views, in standard deviations"});
  keys.number("min_views_new", match.min_views_new, {2, kMaxCameras},
              {.help = "views of a marker that was not predicted; 2 if only two cameras deliver images"});
  keys.number("min_ray_angle_deg", match.min_ray_angle_deg, {0.1, 45},
              {.help = "two rays that are closer to parallel do not determine a depth"});
  keys.numbers("volume_min_m", {match.volume_min_m.data(), 3}, kPlace_m,
               {.help = "x, y, z: no marker is outside of the box from volume_min_m to volume_max_m"});
  keys.numbers("volume_max_m", {match.volume_max_m.data(), 3}, kPlace_m);
}

std::vector<KeyFault> faults_of(const MatchSettings& match) {
  if ((match.volume_min_m.array() < match.volume_max_m.array()).all()) return {};
  return {{"volume_min_m", "volume_min_m is not below volume_max_m on every axis"}};
}

}  // namespace mocap::associate
