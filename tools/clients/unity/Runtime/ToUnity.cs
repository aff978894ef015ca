// The client's vectors as Unity's. The client has converted the axes already.
using UnityEngine;

namespace Mocap {

public static class ToUnity {
  public static Vector3 Position(Vec3 v) { return new Vector3(v.X, v.Y, v.Z); }
  public static Quaternion Rotation(Quat q) { return new Quaternion(q.X, q.Y, q.Z, q.W); }
}

}  // namespace Mocap
