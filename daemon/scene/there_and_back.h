#pragma once

#include <algorithm>
#include <cmath>

namespace mocap::scene {

/// Duration of a reversal of the playback: in 0.6 s, the 3 m/s of a runner become -3 m/s with an acceleration of 1 g.
inline constexpr double kTurnRound_s = 0.6;

/// The position, s, in a recording of `length_s` that is played forward and backward without end, `t_s` after the
/// start. The speed is 1, except for a gradual start and gradual reversals of kTurnRound_s (at most the length of the
/// recording). The playback passes every instant of the recording.
inline double there_and_back_s(double t_s, double length_s) noexcept {
  if (!(length_s > 0.0)) return 0.0;
  const double turn_s = std::min(kTurnRound_s, length_s);
  const double one_way_s = length_s + 0.5 * turn_s;
  double u_s = std::fmod(std::max(0.0, t_s), 2.0 * one_way_s);
  if (u_s > one_way_s) u_s = 2.0 * one_way_s - u_s;
  // The speed changes linearly between 0 and 1 within half of a reversal.
  const double left_s = one_way_s - u_s;
  if (u_s < 0.5 * turn_s) return u_s * u_s / turn_s;
  if (left_s < 0.5 * turn_s) return length_s - left_s * left_s / turn_s;
  return u_s - 0.25 * turn_s;
}

}  // namespace mocap::scene
