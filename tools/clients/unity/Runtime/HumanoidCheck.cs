// Finds the reasons why a character cannot be animated as a humanoid.
using System;
using System.Collections.Generic;
using UnityEngine;

namespace Mocap {

public static class HumanoidCheck {
  // The bones that every humanoid avatar has.
  static readonly HumanBodyBones[] kRequired = {
    HumanBodyBones.Hips, HumanBodyBones.Spine, HumanBodyBones.Head,
    HumanBodyBones.LeftUpperArm, HumanBodyBones.LeftLowerArm, HumanBodyBones.LeftHand,
    HumanBodyBones.RightUpperArm, HumanBodyBones.RightLowerArm, HumanBodyBones.RightHand,
    HumanBodyBones.LeftUpperLeg, HumanBodyBones.LeftLowerLeg, HumanBodyBones.LeftFoot,
    HumanBodyBones.RightUpperLeg, HumanBodyBones.RightLowerLeg, HumanBodyBones.RightFoot
  };

  // An arm of a T-pose differs from the horizontal by less than 20 degrees; an A-pose has 30 to 60.
  const float kMaxArmSlope = 0.342f;  // sine of 20 degrees

  /// Returns the fault that makes animation impossible, with a remedy; an empty string if there is none.
  public static string Fault(Animator animator) {
    if (animator == null) return "no Animator on this object: add the component to the object with the Animator";
    if (animator.avatar == null) {
      return "the Animator has no avatar: set the model's Rig to Animation Type 'Humanoid' and press Apply";
    }
    if (!animator.avatar.isValid) return "the avatar '" + animator.avatar.name + "' is invalid: open Configure Avatar and mend it";
    if (!animator.avatar.isHuman) {
      return "the avatar '" + animator.avatar.name +
             "' is not humanoid: set the model's Rig to Animation Type 'Humanoid' and press Apply";
    }
    var missing = new List<string>();
    foreach (HumanBodyBones bone in kRequired) {
      if (animator.GetBoneTransform(bone) == null) missing.Add(bone.ToString());
    }
    if (missing.Count == 0) return "";
    return "bones without a Transform: " + string.Join(", ", missing.ToArray()) +
           ". Assign them in Configure Avatar, or switch off 'Optimize Game Objects' in the model's Rig";
  }

  /// Returns a sentence if the arms are not horizontal, as in a T-pose; otherwise an empty string. Call without a Fault.
  public static string PoseFault(Animator animator) {
    foreach (bool left in new[] { true, false }) {
      Transform from = animator.GetBoneTransform(left ? HumanBodyBones.LeftUpperArm : HumanBodyBones.RightUpperArm);
      Transform to = animator.GetBoneTransform(left ? HumanBodyBones.LeftLowerArm : HumanBodyBones.RightLowerArm);
      Vector3 along = Quaternion.Inverse(animator.transform.rotation) * (to.position - from.position);
      if (along.magnitude > 0 && Math.Abs(along.y) > kMaxArmSlope * along.magnitude) {
        return "the character is not in T-pose (the " + (left ? "left" : "right") +
               " upper arm is not horizontal), so its arms will be turned by that angle: use Enforce T-Pose in Configure Avatar";
      }
    }
    return "";
  }

  /// Returns the names of the bones that `subject` has and the character does not, e.g. fingers.
  public static List<string> Unmatched(Subject subject, ICollection<string> known) {
    var names = new List<string>();
    foreach (Bone bone in subject.Description.Bones) {
      if (bone.UnityName.Length > 0 && !known.Contains(bone.UnityName)) names.Add(bone.UnityName);
    }
    return names;
  }
}

}  // namespace Mocap
