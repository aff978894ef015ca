#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace mocap::scene {

enum class Act { TPose, APose, Walk, Wave, Jump, Spin, Crouch, Hands };

struct Scene {
  Act act = Act::TPose;
  double duration_s = 0.0;  ///< not used for the last scene, which has no end
};

/// A sequence of acts with their durations in seconds, as "tpose:3,walk:20,wave" (default: 5 s). The last act has no
/// end.
struct Program {
  std::vector<Scene> scenes;
};

/// Reads a program. Fails with InvalidArgument; the message has the wrong word and the list of acts.
Result<Program> parse_program(std::string_view text);

/// Weight of an act in the motion at one instant, and the integral of the weight. Periodic motions use the integral as
/// their time, so that they are continuous during a fade.
struct ActShare {
  Act act = Act::TPose;
  double share = 0.0;    ///< weight, 0 to 1; the weights of an instant add up to 1
  double spent_s = 0.0;  ///< integral of the weight since the start of the scene
  double whole_s = 0.0;  ///< the integral at the end of the scene; infinite for the last scene
};

/// The one or two acts of an instant. Acts fade into each other over 0.6 s.
struct ActMix {
  ActShare first, second;        ///< `second.share` is 0 outside of a fade
  double walked_before_s = 0.0;  ///< integral of the weight of Act::Walk over all scenes up to the instant
};

/// The acts `t_s` after the start of a program with at least one scene.
ActMix mix_at(const Program& program, double t_s);

}  // namespace mocap::scene
