#pragma once

#include <algorithm>
#include <cmath>

namespace mocap::scene {

/// How long who goes back along his own way takes to turn round: over 0.6 s, a runner's 3 m/s become -3 m/s with one g.
inline constexpr double kTurnRound_s = 0.6;

/// Where in a recording of `length_s` one is, who has been going forth and back through it for `t_s` (from 0 on): at
/// its own pace, save that he sets off and turns round within kTurnRound_s (less where the recording is shorter), since
/// nobody can at once. Every instant of the recording is met.
inline double there_and_back_s(double t_s, double length_s) noexcept {
  if (!(length_s > 0.0)) return 0.0;
  const double turn_s = std::min(kTurnRound_s, length_s);
  const double one_way_s = length_s + 0.5 * turn_s;
  double u_s = std::fmod(std::max(0.0, t_s), 2.0 * one_way_s);
  if (u_s > one_way_s) u_s = 2.0 * one_way_s - u_s;
  // The pace rises evenly from 0 to 1 within half the turn, and falls likewise.
  const double left_s = one_way_s - u_s;
  if (u_s < 0.5 * turn_s) return u_s * u_s / turn_s;
  if (left_s < 0.5 * turn_s) return length_s - left_s * left_s / turn_s;
  return u_s - 0.25 * turn_s;
}

}  // namespace mocap::scene
