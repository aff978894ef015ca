#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <string_view>

#include "scene/program.h"

namespace mocap::scene {

/// The joints that the built-in motions move, named as in human18.
enum class Joint {
  Hips,
  Chest,
  Neck,
  Head,
  LeftCollar,
  LeftUpArm,
  LeftLowArm,
  LeftHand,
  LeftUpLeg,
  LeftLowLeg,
  LeftFoot,
  RightCollar,
  RightUpArm,
  RightLowArm,
  RightHand,
  RightUpLeg,
  RightLowLeg,
  RightFoot,
};
inline constexpr std::size_t kJoints = 18;
inline constexpr std::array<std::string_view, kJoints> kJointNames{
    "Hips",       "Chest",       "Neck",      "Head",       "LeftCollar",  "LeftUpArm",
    "LeftLowArm", "LeftHand",    "LeftUpLeg", "LeftLowLeg", "LeftFoot",    "RightCollar",
    "RightUpArm", "RightLowArm", "RightHand", "RightUpLeg", "RightLowLeg", "RightFoot"};

/// What a body does with its joints at one instant, whatever its size.
struct Posture {
  std::array<Eigen::Quaterniond, kJoints> turns;      ///< against the parent, by Joint; the Hips' without the heading
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< of the hips on the floor
  double heading_rad = 0.0;                           ///< counter-clockwise from +x
  double lift_m = 0.0;                                ///< of the lower foot over the floor

  const Eigen::Quaterniond& turn(Joint joint) const { return turns[static_cast<std::size_t>(joint)]; }
  Eigen::Quaterniond& turn(Joint joint) { return turns[static_cast<std::size_t>(joint)]; }
};

/// The posture `t_s` after the program began: a person of usual speed and limits (walk 0.9 m/s in a figure of eight
/// within 1.1 m of the centre, jump 0.12 m high), without a jump from one act to the next.
Posture posture_at(const Program& program, double t_s);

}  // namespace mocap::scene
