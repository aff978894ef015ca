// Drives a humanoid by one subject of the feed. Put it beside an Animator with a humanoid avatar that stands in T-pose.
using System;
using System.Collections.Generic;
using UnityEngine;

namespace Mocap {

[AddComponentMenu("Mocap/Mocap Humanoid")]
[RequireComponent(typeof(Animator))]
public sealed class MocapHumanoid : MonoBehaviour {
  [Tooltip("tcp://ADDRESS:PORT of the daemon's feed")]
  public string endpoint = "tcp://127.0.0.1:5570";
  [Tooltip("Name of the subject; empty: the first")]
  public string subject = "";
  [Tooltip("Length of the character's legs over those of the subject")]
  public float scale = 1.0f;
  [Tooltip("CURVE keys, 40 characters each; empty: none")]
  public string serverKey = "", publicKey = "", secretKey = "";

  /// Why no data comes, or that all is well; for an inspector or a label.
  public string Status { get; private set; }

  struct Target {
    public Transform Bone;
    public Quaternion AtRest;  // in the character's root, T-pose
    public bool IsHips;
  }

  readonly Dictionary<string, Target> targets_ = new Dictionary<string, Target>();
  readonly List<HumanoidBone> pose_ = new List<HumanoidBone>();
  Client client_;
  Frame frame_;
  float nextStatus_;

  void OnEnable() {
    ReadRestPose(GetComponent<Animator>());
    frame_ = new Frame();
    try {
      client_ = new Client(endpoint, Axes.Unity, "snapshot", 1, serverKey, publicKey, secretKey);
    } catch (Exception fault) {  // a wrong option, or no native library for this platform
      Status = fault.Message;
      Debug.LogError("mocap: " + fault.Message, this);
      enabled = false;
    }
  }

  void OnDisable() {
    if (client_ != null) client_.Dispose();
    if (frame_ != null) frame_.Dispose();
    client_ = null;
    frame_ = null;
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

  // After the Animator, so that it does not write over the pose.
  void LateUpdate() {
    if (client_ == null) return;
    if (client_.Poll(frame_)) {
      Subject found = subject.Length > 0 ? frame_.FindSubject(subject)
                                         : frame_.Subjects.Count > 0 ? frame_.Subjects[0] : null;
      if (found != null) HumanoidPose.Read(found, pose_);
    }
    Apply();
    if (Time.unscaledTime < nextStatus_) return;
    nextStatus_ = Time.unscaledTime + 1.0f;
    string sentence;
    client_.Diagnose(out sentence);
    Status = sentence;
  }

  void Apply() {
    foreach (HumanoidBone told in pose_) {
      Target target;
      if (!targets_.TryGetValue(told.Name, out target)) continue;
      var turn = new Quaternion(told.Rotation.X, told.Rotation.Y, told.Rotation.Z, told.Rotation.W);
      target.Bone.rotation = transform.rotation * turn * target.AtRest;
      if (!target.IsHips) continue;
      var place = new Vector3(told.Position.X, told.Position.Y, told.Position.Z);
      target.Bone.position = transform.position + transform.rotation * (place * scale);
    }
  }
}

}  // namespace Mocap
