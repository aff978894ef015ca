// As much of UnityEngine as MocapHumanoid.cs uses, so that it is compiled and run where there is no Unity.
using System;
using System.Collections.Generic;

namespace UnityEngine {

public class AddComponentMenu : Attribute { public AddComponentMenu(string path) { } }
public class RequireComponent : Attribute { public RequireComponent(Type type) { } }
public class TooltipAttribute : Attribute { public TooltipAttribute(string text) { } }

public static class Debug { public static void LogError(string text, object of) { Console.Error.WriteLine(text); } }
public static class Time { public static float unscaledTime; }

public enum HumanBodyBones { Hips, Spine, Head, LastBone }

public struct Vector3 {
  public float x, y, z;
  public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
  public static Vector3 operator +(Vector3 a, Vector3 b) { return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z); }
  public static Vector3 operator *(Vector3 a, float k) { return new Vector3(a.x * k, a.y * k, a.z * k); }
}

public struct Quaternion {
  public float x, y, z, w;
  public Quaternion(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
  public static Quaternion Inverse(Quaternion q) { return new Quaternion(-q.x, -q.y, -q.z, q.w); }
  public static Quaternion operator *(Quaternion a, Quaternion b) {
    return new Quaternion(a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
  }
  public static Vector3 operator *(Quaternion q, Vector3 v) {
    Quaternion r = q * new Quaternion(v.x, v.y, v.z, 0) * Inverse(q);
    return new Vector3(r.x, r.y, r.z);
  }
}

public class Transform {
  public Vector3 position;
  public Quaternion rotation = new Quaternion(0, 0, 0, 1);
}

public class MonoBehaviour {
  public bool enabled = true;
  public Transform transform = new Transform();
  public Animator animator = new Animator();
  public T GetComponent<T>() { return (T)(object)animator; }
}

public class Animator {
  public Dictionary<HumanBodyBones, Transform> bones = new Dictionary<HumanBodyBones, Transform>();
  public Transform GetBoneTransform(HumanBodyBones name) {
    Transform bone;
    return bones.TryGetValue(name, out bone) ? bone : null;
  }
}

}  // namespace UnityEngine
