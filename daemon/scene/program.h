#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace mocap::scene {

enum class Act { TPose, APose, Walk, Wave, Jump, Spin, Crouch };

struct Scene {
  Act act = Act::TPose;
  double duration_s = 0.0;  ///< of the last one: without end
};

/// What somebody does one after the other, as "tpose:3,walk:20,wave": acts with their seconds (5 where none are given);
/// the last goes on for ever.
struct Program {
  std::vector<Scene> scenes;
};

/// Fails with InvalidArgument, naming the word that is wrong and the acts there are.
Result<Program> parse_program(std::string_view text);

/// How much of an act is in the motion at one instant, and how much of it there was before (its integral), so that what
/// moves on with time does so without a jump.
struct ActShare {
  Act act = Act::TPose;
  double share = 0.0;    ///< 0 to 1; all shares add up to 1
  double spent_s = 0.0;  ///< integral of the share since this scene began
  double whole_s = 0.0;  ///< the integral when the scene has ended; infinite for the last
};

/// The one or two acts of an instant; they fade into each other over 0.6 s.
struct ActMix {
  ActShare first, second;        ///< `second.share` is 0 where only one act goes on
  double walked_before_s = 0.0;  ///< integral of walking over all scenes up to the instant
};

ActMix mix_at(const Program& program, double t_s);

}  // namespace mocap::scene
