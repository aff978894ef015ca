// The part of UnityEngine that the package uses, with the behaviour that the documentation of Unity 2021.3 describes, so that
// the package can be compiled and run without Unity.
using System;
using System.Collections.Generic;

namespace UnityEngine {

[AttributeUsage(AttributeTargets.Class)]
public sealed class AddComponentMenu : Attribute { public AddComponentMenu(string menuName) { } }
[AttributeUsage(AttributeTargets.Class)]
public sealed class DisallowMultipleComponent : Attribute { }
[AttributeUsage(AttributeTargets.Class)]
public sealed class DefaultExecutionOrder : Attribute { public DefaultExecutionOrder(int order) { } }
[AttributeUsage(AttributeTargets.Class)]
public sealed class RequireComponent : Attribute { public RequireComponent(Type requiredComponent) { } }
[AttributeUsage(AttributeTargets.Field)]
public sealed class TooltipAttribute : Attribute { public TooltipAttribute(string tooltip) { } }

public static class Application { public static bool isPlaying = true; }
public static class Time { public static float unscaledTime; }

public static class Debug {
  public static readonly List<string> Said = new List<string>();
  public static void LogWarning(object message, Object context) { Said.Add("warning: " + message); }
  public static void LogError(object message, Object context) { Said.Add("error: " + message); }
}

public struct Vector3 {
  public float x, y, z;
  public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
  public float magnitude { get { return (float)Math.Sqrt(x * x + y * y + z * z); } }
  public static Vector3 operator +(Vector3 a, Vector3 b) { return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z); }
  public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3(a.x - b.x, a.y - b.y, a.z - b.z); }
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

public class Object {
  public string name = "";
  public bool IsDestroyed;  // not in Unity, where a destroyed object is equal to null
  public static void Destroy(Object obj) { obj.IsDestroyed = true; }
  public static GameObject Instantiate(GameObject original, Transform parent) {
    var copy = new GameObject(original.name + "(Clone)");
    copy.transform.SetParent(parent, false);
    return copy;
  }
}

public sealed class GameObject : Object {
  readonly List<Component> components_ = new List<Component>();
  public Transform transform;
  public bool activeSelf = true;

  public GameObject() : this("GameObject") { }
  public GameObject(string name) {
    this.name = name;
    transform = AddComponent<Transform>();
  }
  public void SetActive(bool value) { activeSelf = value; }
  public T AddComponent<T>() where T : Component {
    var made = (T)Activator.CreateInstance(typeof(T));
    made.gameObject = this;
    components_.Add(made);
    return made;
  }
  public T GetComponent<T>() where T : class {
    foreach (Component each in components_) {
      var found = each as T;
      if (found != null) return found;
    }
    return null;
  }
  public static GameObject CreatePrimitive(PrimitiveType type) {
    var made = new GameObject(type.ToString());
    made.AddComponent<Collider>();
    return made;
  }
}

public enum PrimitiveType { Sphere, Capsule, Cylinder, Cube, Plane, Quad }

public class Component : Object {
  public GameObject gameObject;
  public Transform transform { get { return gameObject.transform; } }
  public T GetComponent<T>() where T : class { return gameObject.GetComponent<T>(); }
}

public sealed class Transform : Component {
  public Vector3 localPosition;
  public Quaternion localRotation = new Quaternion(0, 0, 0, 1);
  public Vector3 localScale = new Vector3(1, 1, 1);
  public Transform parent;

  public void SetParent(Transform parent, bool worldPositionStays) { this.parent = parent; }
  // The scale of a parent is 1 in the tests.
  public Vector3 position {
    get { return parent == null ? localPosition : parent.position + parent.rotation * localPosition; }
    set { localPosition = parent == null ? value : Quaternion.Inverse(parent.rotation) * (value - parent.position); }
  }
  public Quaternion rotation {
    get { return parent == null ? localRotation : parent.rotation * localRotation; }
    set { localRotation = parent == null ? value : Quaternion.Inverse(parent.rotation) * value; }
  }
}

public class Behaviour : Component { public bool enabled = true; }
public class MonoBehaviour : Behaviour { }
public class Collider : Component { }
public class Material : Object { }
public class Renderer : Component {
  public bool enabled = true;
  public Material sharedMaterial;
}

public sealed class LineRenderer : Renderer {
  public bool useWorldSpace = true;
  public int positionCount;
  public float startWidth, endWidth;
  public readonly Vector3[] Positions = new Vector3[2];
  public void SetPosition(int index, Vector3 position) { Positions[index] = position; }
}

public class Avatar : Object { public bool isValid, isHuman; }

public class Animator : Behaviour {
  public Avatar avatar;
  public readonly Dictionary<HumanBodyBones, Transform> Bones = new Dictionary<HumanBodyBones, Transform>();
  public Transform GetBoneTransform(HumanBodyBones humanBoneId) {
    if (avatar == null || !avatar.isHuman) throw new InvalidOperationException("Avatar is null or not humanoid.");
    Transform bone;
    return Bones.TryGetValue(humanBoneId, out bone) ? bone : null;
  }
}

public enum HumanBodyBones {
  Hips, LeftUpperLeg, RightUpperLeg, LeftLowerLeg, RightLowerLeg, LeftFoot, RightFoot, Spine, Chest, Neck, Head,
  LeftShoulder, RightShoulder, LeftUpperArm, RightUpperArm, LeftLowerArm, RightLowerArm, LeftHand, RightHand, LeftToes,
  RightToes, LeftEye, RightEye, Jaw, LeftThumbProximal, LeftThumbIntermediate, LeftThumbDistal, LeftIndexProximal,
  LeftIndexIntermediate, LeftIndexDistal, LeftMiddleProximal, LeftMiddleIntermediate, LeftMiddleDistal, LeftRingProximal,
  LeftRingIntermediate, LeftRingDistal, LeftLittleProximal, LeftLittleIntermediate, LeftLittleDistal, RightThumbProximal,
  RightThumbIntermediate, RightThumbDistal, RightIndexProximal, RightIndexIntermediate, RightIndexDistal,
  RightMiddleProximal, RightMiddleIntermediate, RightMiddleDistal, RightRingProximal, RightRingIntermediate,
  RightRingDistal, RightLittleProximal, RightLittleIntermediate, RightLittleDistal, UpperChest, LastBone
}

}  // namespace UnityEngine
