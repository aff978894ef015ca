// Converts one subject of a frame to the bones of a humanoid. Plain C# without UnityEngine, so that it can be tested
// without Unity.
using System.Collections.Generic;

namespace Mocap {

/// The pose of one bone in Unity's axes. The rotation is relative to the T-pose.
public struct HumanoidBone {
  public string Name;  // value of UnityEngine.HumanBodyBones
  public Vec3 Position;
  public Quat Rotation;
}

public static class HumanoidPose {
  /// Fills `into` with the bones of `subject` that have a name in HumanBodyBones and a known pose, parents first. The
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
