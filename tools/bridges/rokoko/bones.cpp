#include "bridges/rokoko/bones.h"

#include <array>

namespace mocap::rokoko {
namespace {

// Quaternions are x y z w.
constexpr std::array<Bone, 63> kBones{{
    {"hip", "Hips", -1, Section::Body, {0.0F, 0.0F, 0.0F, -1.0F}},
    {"spine", "Spine", 0, Section::Body, {0.0F, 0.0F, -1.0F, 0.0F}},
    {"chest", "Chest", 1, Section::Body, {0.0F, 0.0F, -1.0F, 0.0F}},
    {"neck", "Neck", 2, Section::Body, {0.0F, 0.0F, -1.0F, 0.0F}},
    {"head", "Head", 3, Section::Body, {0.0F, 0.0F, -1.0F, 0.0F}},
    {"leftShoulder", "LeftShoulder", 2, Section::Body, {0.0F, 0.0F, 0.70710678F, -0.70710678F}},
    {"leftUpperArm", "LeftUpperArm", 5, Section::Body, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftLowerArm", "LeftLowerArm", 6, Section::Body, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftHand", "LeftHand", 7, Section::Body, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"rightShoulder", "RightShoulder", 2, Section::Body, {0.0F, 0.0F, 0.70710678F, 0.70710678F}},
    {"rightUpperArm", "RightUpperArm", 9, Section::Body, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightLowerArm", "RightLowerArm", 10, Section::Body, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightHand", "RightHand", 11, Section::Body, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"leftUpLeg", "LeftUpperLeg", 0, Section::Body, {0.0F, 0.70710678F, 0.0F, 0.70710678F}},
    {"leftLeg", "LeftLowerLeg", 13, Section::Body, {0.0F, 0.70710678F, 0.0F, 0.70710678F}},
    {"leftFoot", "LeftFoot", 14, Section::Body, {0.0F, 0.70710678F, -0.70710678F, 0.0F}},
    {"leftToe", "LeftToes", 15, Section::Body, {0.0F, 0.70710678F, -0.70710678F, 0.0F}},
    {"leftToeEnd", "", 16, Section::Body, {0.0F, 0.70710678F, -0.70710678F, 0.0F}},
    {"rightUpLeg", "RightUpperLeg", 0, Section::Body, {0.0F, -0.70710678F, 0.0F, 0.70710678F}},
    {"rightLeg", "RightLowerLeg", 18, Section::Body, {0.0F, -0.70710678F, 0.0F, 0.70710678F}},
    {"rightFoot", "RightFoot", 19, Section::Body, {0.0F, -0.70710678F, 0.70710678F, 0.0F}},
    {"rightToe", "RightToes", 20, Section::Body, {0.0F, -0.70710678F, 0.70710678F, 0.0F}},
    {"rightToeEnd", "", 21, Section::Body, {0.0F, -0.70710678F, 0.70710678F, 0.0F}},
    {"leftThumbProximal", "LeftThumbProximal", 8, Section::LeftGlove, {-0.56098F, -0.70106F, 0.43046F, -0.0923F}},
    {"leftThumbMedial", "LeftThumbIntermediate", 23, Section::LeftGlove, {-0.65328F, -0.65328F, 0.2706F, -0.2706F}},
    {"leftThumbDistal", "LeftThumbDistal", 24, Section::LeftGlove, {-0.65328F, -0.65328F, 0.2706F, -0.2706F}},
    {"leftThumbTip", "", 25, Section::LeftGlove, {-0.65328F, -0.65328F, 0.2706F, -0.2706F}},
    {"leftIndexProximal", "LeftIndexProximal", 8, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftIndexMedial", "LeftIndexIntermediate", 27, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftIndexDistal", "LeftIndexDistal", 28, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftIndexTip", "", 29, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftMiddleProximal", "LeftMiddleProximal", 8, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftMiddleMedial", "LeftMiddleIntermediate", 31, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftMiddleDistal", "LeftMiddleDistal", 32, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftMiddleTip", "", 33, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftRingProximal", "LeftRingProximal", 8, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftRingMedial", "LeftRingIntermediate", 35, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftRingDistal", "LeftRingDistal", 36, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftRingTip", "", 37, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftLittleProximal", "LeftLittleProximal", 8, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftLittleMedial", "LeftLittleIntermediate", 39, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftLittleDistal", "LeftLittleDistal", 40, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"leftLittleTip", "", 41, Section::LeftGlove, {-0.5F, -0.5F, 0.5F, -0.5F}},
    {"rightThumbProximal", "RightThumbProximal", 12, Section::RightGlove, {0.56099F, -0.70106F, 0.43046F, 0.0923F}},
    {"rightThumbMedial", "RightThumbIntermediate", 43, Section::RightGlove, {0.65328F, -0.65328F, 0.2706F, 0.2706F}},
    {"rightThumbDistal", "RightThumbDistal", 44, Section::RightGlove, {0.65328F, -0.65328F, 0.2706F, 0.2706F}},
    {"rightThumbTip", "", 45, Section::RightGlove, {0.65328F, -0.65328F, 0.2706F, 0.2706F}},
    {"rightIndexProximal", "RightIndexProximal", 12, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightIndexMedial", "RightIndexIntermediate", 47, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightIndexDistal", "RightIndexDistal", 48, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightIndexTip", "", 49, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightMiddleProximal", "RightMiddleProximal", 12, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightMiddleMedial", "RightMiddleIntermediate", 51, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightMiddleDistal", "RightMiddleDistal", 52, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightMiddleTip", "", 53, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightRingProximal", "RightRingProximal", 12, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightRingMedial", "RightRingIntermediate", 55, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightRingDistal", "RightRingDistal", 56, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightRingTip", "", 57, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightLittleProximal", "RightLittleProximal", 12, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightLittleMedial", "RightLittleIntermediate", 59, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightLittleDistal", "RightLittleDistal", 60, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
    {"rightLittleTip", "", 61, Section::RightGlove, {0.5F, -0.5F, 0.5F, 0.5F}},
}};

}  // namespace

std::span<const Bone> all_bones() { return kBones; }

}  // namespace mocap::rokoko
