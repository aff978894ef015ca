#pragma once

#include <array>
#include <string_view>
#include <utility>

namespace mocap::exports {

/// HumanBodyBones (Unity) and the name of the same bone in HumanIK's default template. Mixamo has the same names with
/// the prefix `mixamorig:`. A finger of Unity has three bones: proximal, intermediate, distal. Sources: documentation
/// of Unity 2022, `HumanBodyBones`; documentation of MotionBuilder 2022, "Character map: naming template"; the skeleton
/// of Mixamo's characters.
inline constexpr std::array<std::pair<std::string_view, std::string_view>, 55> kHumanIkNames{{
    {"Hips", "Hips"},
    {"Spine", "Spine"},
    {"Chest", "Spine1"},
    {"UpperChest", "Spine2"},
    {"Neck", "Neck"},
    {"Head", "Head"},
    {"LeftEye", "LeftEye"},
    {"RightEye", "RightEye"},
    {"Jaw", "Jaw"},
    {"LeftShoulder", "LeftShoulder"},
    {"LeftUpperArm", "LeftArm"},
    {"LeftLowerArm", "LeftForeArm"},
    {"LeftHand", "LeftHand"},
    {"LeftUpperLeg", "LeftUpLeg"},
    {"LeftLowerLeg", "LeftLeg"},
    {"LeftFoot", "LeftFoot"},
    {"LeftToes", "LeftToeBase"},
    {"RightShoulder", "RightShoulder"},
    {"RightUpperArm", "RightArm"},
    {"RightLowerArm", "RightForeArm"},
    {"RightHand", "RightHand"},
    {"RightUpperLeg", "RightUpLeg"},
    {"RightLowerLeg", "RightLeg"},
    {"RightFoot", "RightFoot"},
    {"RightToes", "RightToeBase"},
    {"LeftThumbProximal", "LeftHandThumb1"},
    {"LeftThumbIntermediate", "LeftHandThumb2"},
    {"LeftThumbDistal", "LeftHandThumb3"},
    {"LeftIndexProximal", "LeftHandIndex1"},
    {"LeftIndexIntermediate", "LeftHandIndex2"},
    {"LeftIndexDistal", "LeftHandIndex3"},
    {"LeftMiddleProximal", "LeftHandMiddle1"},
    {"LeftMiddleIntermediate", "LeftHandMiddle2"},
    {"LeftMiddleDistal", "LeftHandMiddle3"},
    {"LeftRingProximal", "LeftHandRing1"},
    {"LeftRingIntermediate", "LeftHandRing2"},
    {"LeftRingDistal", "LeftHandRing3"},
    {"LeftLittleProximal", "LeftHandPinky1"},
    {"LeftLittleIntermediate", "LeftHandPinky2"},
    {"LeftLittleDistal", "LeftHandPinky3"},
    {"RightThumbProximal", "RightHandThumb1"},
    {"RightThumbIntermediate", "RightHandThumb2"},
    {"RightThumbDistal", "RightHandThumb3"},
    {"RightIndexProximal", "RightHandIndex1"},
    {"RightIndexIntermediate", "RightHandIndex2"},
    {"RightIndexDistal", "RightHandIndex3"},
    {"RightMiddleProximal", "RightHandMiddle1"},
    {"RightMiddleIntermediate", "RightHandMiddle2"},
    {"RightMiddleDistal", "RightHandMiddle3"},
    {"RightRingProximal", "RightHandRing1"},
    {"RightRingIntermediate", "RightHandRing2"},
    {"RightRingDistal", "RightHandRing3"},
    {"RightLittleProximal", "RightHandPinky1"},
    {"RightLittleIntermediate", "RightHandPinky2"},
    {"RightLittleDistal", "RightHandPinky3"},
}};

}  // namespace mocap::exports
