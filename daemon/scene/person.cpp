#include "scene/person.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mocap::scene {
namespace {

using std::numbers::pi;
constexpr double kWalkSpeed_m_s = 0.9;
constexpr double kStride_m = 1.05;      // two steps
constexpr double kPathRadius_m = 0.55;  // of each loop of the figure of eight: the hips stay within 1.1 m of the centre
constexpr double kTurn_s = 3.0;         // one rotation of a spin
constexpr double kArmDown_rad = 1.3;    // of an arm that hangs beside the body, from T-pose
constexpr double kGravity_m_s2 = 9.81;

Eigen::Quaterniond about_x(double rad) { return Eigen::Quaterniond(Eigen::AngleAxisd(rad, Eigen::Vector3d::UnitX())); }
Eigen::Quaterniond about_y(double rad) { return Eigen::Quaterniond(Eigen::AngleAxisd(rad, Eigen::Vector3d::UnitY())); }
Eigen::Quaterniond about_z(double rad) { return Eigen::Quaterniond(Eigen::AngleAxisd(rad, Eigen::Vector3d::UnitZ())); }

Posture t_pose() {
  Posture posture;
  posture.rotations.fill(Eigen::Quaterniond::Identity());
  return posture;
}

Posture a_pose() {
  Posture posture = t_pose();
  posture.rotation(Joint::LeftUpArm) = about_x(-0.25 * pi);
  posture.rotation(Joint::RightUpArm) = about_x(0.25 * pi);
  return posture;
}

// Lowers the arms and swings them forward (positive angles) about the shoulders; bends the elbows forward.
void hang_arms(Posture& posture, double swing_left_rad, double swing_right_rad, double elbow_rad) {
  posture.rotation(Joint::LeftUpArm) = about_y(-swing_left_rad) * about_x(-kArmDown_rad);
  posture.rotation(Joint::RightUpArm) = about_y(-swing_right_rad) * about_x(kArmDown_rad);
  posture.rotation(Joint::LeftLowArm) = about_z(-elbow_rad);
  posture.rotation(Joint::RightLowArm) = about_z(elbow_rad);
}

// Bends both legs so that the feet stay flat and below the hips.
void bend_knees(Posture& posture, double half_rad) {
  for (const Joint thigh : {Joint::LeftUpLeg, Joint::RightUpLeg}) {
    const auto first = static_cast<std::size_t>(thigh);
    posture.rotations[first] = about_y(-half_rad);
    posture.rotations[first + 1] = about_y(2.0 * half_rad);
    posture.rotations[first + 2] = about_y(-half_rad);
  }
}

void step_leg(Posture& posture, Joint thigh, double phase_rad) {
  const auto first = static_cast<std::size_t>(thigh);
  const double swing = 0.5 * (1.0 + std::cos(phase_rad));  // 1 while the leg swings forward
  const double hip_rad = 0.08 + 0.42 * std::sin(phase_rad);
  const double knee_rad = 0.12 + 0.75 * swing * swing;
  posture.rotations[first] = about_y(-hip_rad);
  posture.rotations[first + 1] = about_y(knee_rad);
  posture.rotations[first + 2] = about_y(std::clamp(hip_rad - knee_rad, -0.6, 0.6) * 0.6);
}

Posture walk(double walked_s) {
  Posture posture = t_pose();
  const double phase_rad = 2.0 * pi * walked_s * kWalkSpeed_m_s / kStride_m;
  step_leg(posture, Joint::LeftUpLeg, phase_rad);
  step_leg(posture, Joint::RightUpLeg, phase_rad + pi);
  const double swing_rad = 0.35 * std::sin(phase_rad);
  hang_arms(posture, -swing_rad, swing_rad, 0.35 + 0.1 * std::sin(phase_rad));
  posture.rotation(Joint::Hips) = about_z(-0.08 * std::sin(phase_rad)) * about_x(0.04 * std::cos(phase_rad));
  posture.rotation(Joint::Chest) =
      about_z(0.16 * std::sin(phase_rad)) * about_y(0.05) * about_x(-0.04 * std::cos(phase_rad));
  posture.rotation(Joint::Neck) = about_z(-0.08 * std::sin(phase_rad));
  return posture;
}

Posture wave(double t_s) {
  Posture posture = t_pose();
  hang_arms(posture, 0.05, 0.0, 0.2);
  const double beat_rad = 2.0 * pi * 1.1 * t_s;
  // The upper arm points to the side and is rotated so that the elbow bends upwards; the forearm waves.
  posture.rotation(Joint::RightUpArm) = about_x(-0.3) * about_y(-0.5 * pi);
  posture.rotation(Joint::RightLowArm) = about_z(1.3 + 0.5 * std::sin(beat_rad));
  posture.rotation(Joint::RightHand) = about_z(0.3 * std::sin(beat_rad - 0.6));
  posture.rotation(Joint::Head) = about_z(-0.25);
  posture.rotation(Joint::Chest) = about_x(0.04 * std::sin(0.5 * beat_rad));
  return posture;
}

Posture jump(double t_s) {
  constexpr double kHeight_m = 0.12, kDip_s = 0.5, kPush_s = 0.28, kLand_s = 0.75, kDepth_m = 0.24;
  const double up_m_s = std::sqrt(2.0 * kGravity_m_s2 * kHeight_m);
  const double flight_s = 2.0 * up_m_s / kGravity_m_s2;
  const double cycle_s = kDip_s + kPush_s + flight_s + kLand_s;
  double t = std::fmod(t_s, cycle_s);

  Posture posture = t_pose();
  double dip = 0.0;  // knee bend, 0 to 1
  double away_s = t - kDip_s - kPush_s;
  if (t < kDip_s) {
    dip = 0.5 * (1.0 - std::cos(pi * t / kDip_s));
  } else if (away_s < 0.0) {
    dip = std::cos(0.5 * pi * (t - kDip_s) / kPush_s);
  } else if (away_s < flight_s) {
    posture.lift_m = up_m_s * away_s - 0.5 * kGravity_m_s2 * away_s * away_s;
  } else {
    // The knees bend with the speed of landing, then stretch again.
    const double landed_s = away_s - flight_s, u = landed_s / kLand_s;
    dip = up_m_s / kDepth_m * landed_s * std::exp(-landed_s / 0.13) * (1.0 - u * u);
  }
  // A leg of two segments of l = 0.42 m has the height 2 l cos(half).
  const double half_rad = std::acos(1.0 - (0.05 + kDepth_m * dip) / 0.84);
  bend_knees(posture, half_rad);
  posture.rotation(Joint::Hips) = about_y(0.35 * dip);
  for (const Joint thigh : {Joint::LeftUpLeg, Joint::RightUpLeg}) {
    posture.rotation(thigh) = about_y(-0.35 * dip) * posture.rotation(thigh);
  }
  // The arms swing continuously and are foremost at the top of the flight.
  const double top_s = kDip_s + kPush_s + 0.5 * flight_s;
  const double swing_rad = 0.2 + 0.6 * std::cos(2.0 * pi * (t - top_s) / cycle_s);
  hang_arms(posture, swing_rad, swing_rad, 0.5);
  return posture;
}

Posture crouch(double t_s) {
  const double down = 0.5 * (1.0 - std::cos(2.0 * pi * t_s / 4.0));
  Posture posture = t_pose();
  const double half_rad = 0.1 + 0.75 * down;
  bend_knees(posture, half_rad);
  const double lean_rad = 0.45 * down;
  posture.rotation(Joint::Hips) = about_y(lean_rad);
  for (const Joint thigh : {Joint::LeftUpLeg, Joint::RightUpLeg}) {
    posture.rotation(thigh) = about_y(-lean_rad) * posture.rotation(thigh);
  }
  posture.rotation(Joint::Chest) = about_y(0.3 * down);
  posture.rotation(Joint::Neck) = about_y(-0.4 * down);
  hang_arms(posture, 0.1 + 1.1 * down, 0.1 + 1.1 * down, 0.3);
  return posture;
}

// An arm in front of the body: rotation vectors of upper arm and hand, and the bend of the elbow. For the left arm; the
// right one is its mirror image.
struct ArmInFront {
  Eigen::Vector3d upper_rad;
  double elbow_rad;
  Eigen::Vector3d hand_rad;
};

Eigen::Quaterniond turned(const Eigen::Vector3d& rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(rad.norm(), rad.normalized()));
}

ArmInFront between(const ArmInFront& from, const ArmInFront& to, double share) {
  return {from.upper_rad + share * (to.upper_rad - from.upper_rad),
          from.elbow_rad + share * (to.elbow_rad - from.elbow_rad),
          from.hand_rad + share * (to.hand_rad - from.hand_rad)};
}

void set_arms(Posture& posture, const ArmInFront& left, const ArmInFront& right) {
  const Eigen::Vector3d mirrored(-1.0, 1.0, -1.0);
  posture.rotation(Joint::LeftUpArm) = turned(left.upper_rad);
  posture.rotation(Joint::LeftLowArm) = about_z(left.elbow_rad);
  posture.rotation(Joint::LeftHand) = turned(left.hand_rad);
  posture.rotation(Joint::RightUpArm) = turned(right.upper_rad.cwiseProduct(mirrored));
  posture.rotation(Joint::RightLowArm) = about_z(-right.elbow_rad);
  posture.rotation(Joint::RightHand) = turned(right.hand_rad.cwiseProduct(mirrored));
}

// Bends each finger in its knuckle and its middle joint, and spreads it.
void bend_fingers(Posture& posture, double t_s) {
  constexpr double kBend_rad = 1.1, kSpread_rad = 0.12, kThumb_rad = 0.5;
  for (std::size_t finger = 0; finger < kFingers; ++finger) {
    const bool is_left = finger < kFingers / 2;
    const double of_hand = static_cast<double>(finger % (kFingers / 2));
    const double phase_rad = 2.0 * pi * (0.7 * t_s - 0.13 * of_hand) + (is_left ? 0.0 : 1.0);
    const double bend = 0.5 * (1.0 - std::cos(phase_rad));
    const double sign = is_left ? 1.0 : -1.0;  // the right hand is the mirror image
    const std::size_t knuckle = static_cast<std::size_t>(Joint::LeftThumb) + finger;
    const std::size_t middle = static_cast<std::size_t>(Joint::LeftThumbEnd) + finger;
    if (of_hand == 0.0) {
      posture.rotations[knuckle] = about_z(sign * kThumb_rad * bend) * about_x(-sign * 0.5 * kThumb_rad * bend);
      posture.rotations[middle] = about_z(sign * kThumb_rad * bend);
    } else {
      const double spread_rad = kSpread_rad * (of_hand - 2.5) * std::sin(0.5 * phase_rad);
      posture.rotations[knuckle] = about_z(sign * spread_rad) * about_x(-sign * kBend_rad * bend);
      posture.rotations[middle] = about_x(-sign * kBend_rad * bend);
    }
  }
}

// The hands in front of the chest; they touch each other, then the right hand touches the face. Fingers bend all the
// time.
Posture hands(double t_s) {
  constexpr double kCycle_s = 9.0;
  const ArmInFront ready{{-1.24, 0.17, -0.20}, -1.68, {0.16, -0.05, -0.18}};
  const ArmInFront touching{{-0.87, 0.19, -0.62}, -1.63, {-0.13, -0.30, -0.33}};
  const ArmInFront at_face{{-0.95, -0.49, -0.87}, -2.11, {-0.31, -1.19, -0.25}};
  const double phase_s = std::fmod(t_s, kCycle_s), share = 0.5 * (1.0 - std::cos(4.0 * pi * t_s / kCycle_s));
  const bool they_touch = phase_s < 0.5 * kCycle_s;
  Posture posture = t_pose();
  set_arms(posture, between(ready, touching, they_touch ? share : 0.0),
           between(ready, they_touch ? touching : at_face, share));
  bend_fingers(posture, t_s);
  return posture;
}

Posture spin(const ActShare& share) {
  Posture posture = t_pose();
  const double beat_rad = 2.0 * pi * share.spent_s / 0.75;  // small steps on the spot
  hang_arms(posture, 0.1, 0.1, 0.4);
  posture.rotation(Joint::LeftUpArm) = about_x(-0.6);
  posture.rotation(Joint::RightUpArm) = about_x(0.6);
  for (const auto& [thigh, side] : {std::pair{Joint::LeftUpLeg, 0.0}, std::pair{Joint::RightUpLeg, pi}}) {
    const auto first = static_cast<std::size_t>(thigh);
    const double lift = 0.08 + 0.22 * 0.5 * (1.0 + std::cos(beat_rad + side));
    posture.rotations[first] = about_y(-lift);
    posture.rotations[first + 1] = about_y(2.0 * lift);
    posture.rotations[first + 2] = about_y(-lift);
  }
  // A whole number of rotations, so that the next act starts with the same heading.
  const double turns = std::isinf(share.whole_s)
                           ? share.spent_s / kTurn_s
                           : std::max(1.0, std::round(share.whole_s / kTurn_s)) * share.spent_s / share.whole_s;
  posture.heading_rad = 2.0 * pi * turns;
  return posture;
}

Posture perform(const ActShare& share, double walked_s) {
  switch (share.act) {
    case Act::Walk: return walk(walked_s);
    case Act::Wave: return wave(share.spent_s);
    case Act::Jump: return jump(share.spent_s);
    case Act::Spin: return spin(share);
    case Act::Crouch: return crouch(share.spent_s);
    case Act::Hands: return hands(share.spent_s);
    case Act::APose: return a_pose();
    case Act::TPose: break;
  }
  return t_pose();
}

// The path is two circles that touch in the centre of the volume, one after the other; the heading there is +x.
void put_on_path(Posture& posture, double walked_s) {
  const double loop_rad = walked_s * kWalkSpeed_m_s / kPathRadius_m;
  const double side = std::fmod(loop_rad, 4.0 * pi) < 2.0 * pi ? 1.0 : -1.0;
  posture.place_m = {kPathRadius_m * std::sin(loop_rad), side * kPathRadius_m * (1.0 - std::cos(loop_rad))};
  posture.heading_rad += side * std::fmod(loop_rad, 2.0 * pi);
}

}  // namespace

Posture posture_at(const Program& program, double t_s) {
  const ActMix mix = mix_at(program, t_s);
  Posture posture = perform(mix.first, mix.walked_before_s);
  if (mix.second.share > 0.0) {
    const Posture other = perform(mix.second, mix.walked_before_s);
    const double share = mix.second.share;
    for (std::size_t i = 0; i < kJoints; ++i)
      posture.rotations[i] = posture.rotations[i].slerp(share, other.rotations[i]);
    posture.lift_m += share * (other.lift_m - posture.lift_m);
    posture.heading_rad += other.heading_rad;  // a spin fades by its own share
  }
  put_on_path(posture, mix.walked_before_s);
  return posture;
}

}  // namespace mocap::scene
