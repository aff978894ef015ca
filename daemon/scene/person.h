#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <string_view>

#include "scene/program.h"

namespace mocap::scene {

/// The joints that the built-in motions move, named as in human38. A skeleton may lack some of them.
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
  LeftThumb,  // the knuckles of the left hand, of the right hand, then the middle joints in the same order
  RightThumb = LeftThumb + 5,
  LeftThumbEnd = LeftThumb + 10,
};
inline constexpr std::size_t kFingers = 10;  ///< of both hands
inline constexpr std::size_t kJoints = 38;
inline constexpr std::array<std::string_view, kJoints> kJointNames{
    "Hips",           "Chest",        "Neck",          "Head",        "LeftCollar",    "LeftUpArm",     "LeftLowArm",
    "LeftHand",       "LeftUpLeg",    "LeftLowLeg",    "LeftFoot",    "RightCollar",   "RightUpArm",    "RightLowArm",
    "RightHand",      "RightUpLeg",   "RightLowLeg",   "RightFoot",   "LeftThumb",     "LeftIndex",     "LeftMiddle",
    "LeftRing",       "LeftLittle",   "RightThumb",    "RightIndex",  "RightMiddle",   "RightRing",     "RightLittle",
    "LeftThumbEnd",   "LeftIndexEnd", "LeftMiddleEnd", "LeftRingEnd", "LeftLittleEnd", "RightThumbEnd", "RightIndexEnd",
    "RightMiddleEnd", "RightRingEnd", "RightLittleEnd"};

/// A pose of a person, independent of the body's size.
struct Posture {
  std::array<Eigen::Quaterniond, kJoints> rotations;  ///< rotation relative to the parent; the Hips without the heading
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< horizontal position of the hips
  double heading_rad = 0.0;                           ///< counter-clockwise from +x
  double lift_m = 0.0;                                ///< height of the lower foot above the floor

  const Eigen::Quaterniond& rotation(Joint joint) const { return rotations[static_cast<std::size_t>(joint)]; }
  Eigen::Quaterniond& rotation(Joint joint) { return rotations[static_cast<std::size_t>(joint)]; }
};

/// The posture `t_s` after the start of the program, with the speeds and limits of a usual person: walk at 0.9 m/s in a
/// figure of eight within 1.1 m of the centre, jumps 0.12 m high. Continuous from one act to the next.
Posture posture_at(const Program& program, double t_s);

}  // namespace mocap::scene
