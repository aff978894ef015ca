// Animates a humanoid with one subject of the feed. Add it to an object that has an Animator with a humanoid avatar, with
// the character in T-pose.
using System;
using System.Collections.Generic;
using UnityEngine;

namespace Mocap {

[AddComponentMenu("Mocap/Mocap Humanoid")]
[RequireComponent(typeof(Animator))]
public sealed class MocapHumanoid : MocapReceiver {
  [Tooltip("Name of the subject; empty: the first person")]
  public string subject = "";
  [Tooltip("Leg length of the character divided by that of the subject")]
  public float scale = 1.0f;

  struct Target {
    public Transform Bone;
    public Quaternion AtRest;  // rotation in the frame of the character's root, in T-pose
    public bool IsHips;
  }

  readonly Dictionary<string, Target> targets_ = new Dictionary<string, Target>();
  readonly List<HumanoidBone> pose_ = new List<HumanoidBone>();
  Frame frame_;
  Subject found_;
  SubjectDescription compared_;
  string fault_ = "";
  string posture_ = "";  // a remark on the character's pose at start
  string lacking_ = "";  // bones that the subject has and the character lacks

  void OnEnable() {
    var animator = GetComponent<Animator>();
    compared_ = null;
    pose_.Clear();
    fault_ = HumanoidCheck.Fault(animator);
    if (fault_.Length > 0) {
      Debug.LogError("mocap: " + fault_, this);
      enabled = false;
      return;
    }
    posture_ = HumanoidCheck.PoseFault(animator);
    if (posture_.Length > 0) Debug.LogWarning("mocap: " + posture_, this);
    ReadRestPose(animator);
  }

  void ReadRestPose(Animator animator) {
    targets_.Clear();
    foreach (HumanBodyBones name in Enum.GetValues(typeof(HumanBodyBones))) {
      if (name == HumanBodyBones.LastBone) continue;
      Transform bone = animator.GetBoneTransform(name);
      if (bone == null) continue;
      targets_[name.ToString()] = new Target {
        Bone = bone,
        AtRest = Quaternion.Inverse(transform.rotation) * bone.rotation,
        IsHips = name == HumanBodyBones.Hips
      };
    }
  }

  protected override void Show(Frame frame, bool isNew) {
    if (isNew) Read(frame);
    Apply();
  }

  // The character keeps its last pose, also if the Animator plays.
  protected override void ShowNothing() { Apply(); }

  void Read(Frame frame) {
    frame_ = frame;
    found_ = SubjectChoice.Find(frame, subject, SubjectChoice.Person);
    if (found_ == null) return;
    if (found_.Description != compared_) Compare(found_);
    if (found_.BoneCount > 0) HumanoidPose.Read(found_, pose_);
  }

  // Once for each description.
  void Compare(Subject found) {
    compared_ = found.Description;
    List<string> unmatched = HumanoidCheck.Unmatched(found, targets_.Keys);
    lacking_ = unmatched.Count > 0 ? "the character has no " + string.Join(", ", unmatched.ToArray()) : "";
    if (lacking_.Length > 0) Debug.LogWarning("mocap: '" + found.Name + "': " + lacking_, this);
  }

  protected override string Describe() {
    if (fault_.Length > 0) return fault_;
    if (frame_ == null) return "no frame yet";
    if (found_ == null) return SubjectChoice.Fault(frame_, subject, "person");
    string state = "'" + found_.Name + (found_.BoneCount > 0 ? "' is tracked" : "' is not found yet");
    foreach (string remark in new[] { lacking_, posture_ }) {
      if (remark.Length > 0) state += "; " + remark;
    }
    return state;
  }

  void Apply() {
    foreach (HumanoidBone told in pose_) {
      Target target;
      if (!targets_.TryGetValue(told.Name, out target)) continue;
      target.Bone.rotation = transform.rotation * ToUnity.Rotation(told.Rotation) * target.AtRest;
      if (!target.IsHips) continue;
      target.Bone.position = transform.position + transform.rotation * (ToUnity.Position(told.Position) * scale);
    }
  }
}

}  // namespace Mocap
