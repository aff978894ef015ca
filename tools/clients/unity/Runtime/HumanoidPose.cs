// What a humanoid's bones should be, from one subject of a frame. Plain C# without UnityEngine, so that it is tested
// where there is no Unity.
using System.Collections.Generic;

namespace Mocap {

/// A bone to be set, in the axes of Unity, from the subject's place: rotation turns it out of the T-pose.
public struct HumanoidBone {
  public string Name;  // of UnityEngine.HumanBodyBones
  public Vec3 Position;
  public Quat Rotation;
}

public static class HumanoidPose {
  /// Puts the bones of `subject` that have a name in HumanBodyBones and a known pose into `into`, parents first. The
  /// frame must come from a client with Axes.Unity.
  public static void Read(Subject subject, List<HumanoidBone> into) {
    into.Clear();
    for (int i = 0; i < subject.BoneCount; ++i) {
      string name = subject.Description.Bones[i].UnityName;
      BonePose pose = subject.BonePoses[i];
      if (name.Length == 0 || pose.State == State.Lost) continue;
      into.Add(new HumanoidBone { Name = name, Position = pose.Position, Rotation = pose.Rotation });
    }
  }
}

}  // namespace Mocap
