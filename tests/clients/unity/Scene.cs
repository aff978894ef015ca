// Runs the components of the Unity package as a scene would, with stand-ins for Unity, until the feed has shown every subject.
// Prints what the scene shows, as JSON; with until-silent again when the feed is gone. usage: Scene.exe ENDPOINT
// ROOT_TURNED(0|1) SUBJECTS [until-silent]
using System;
using System.Collections.Generic;
using System.Globalization;
using System.Reflection;
using System.Text;
using System.Threading;
using UnityEngine;

static class Scene {
  static readonly float kHalf = (float)Math.Sqrt(0.5);
  const double kLimit_s = 30;

  static void Call(object on, string name) {
    for (Type type = on.GetType(); type != null; type = type.BaseType) {
      const BindingFlags own = BindingFlags.Instance | BindingFlags.NonPublic | BindingFlags.DeclaredOnly;
      MethodInfo method = type.GetMethod(name, own);
      if (method == null) continue;
      method.Invoke(on, null);
      return;
    }
  }

  static string Text(params float[] values) {
    return "[" + string.Join(", ", Array.ConvertAll(values, v => v.ToString("R", CultureInfo.InvariantCulture))) + "]";
  }
  static string Text(Vector3 v) { return Text(v.x, v.y, v.z); }
  static string Text(Quaternion q) { return Text(q.x, q.y, q.z, q.w); }
  static string Text(string text) { return "\"" + text.Replace("\\", "\\\\").Replace("\"", "\\\"") + "\""; }

  // A character in T-pose, whose bones have other axes at rest than the world, as in real rigs.
  static Mocap.MocapHumanoid Character(bool turned) {
    var root = new GameObject("Character");
    if (turned) {
      // At (1, 0, 0), rotated by 90 degrees about the up axis.
      root.transform.rotation = new Quaternion(0, kHalf, 0, kHalf);
      root.transform.position = new Vector3(1, 0, 0);
    }
    var animator = root.AddComponent<Animator>();
    animator.avatar = new Avatar { name = "Character", isValid = true, isHuman = true };
    foreach (HumanBodyBones name in Enum.GetValues(typeof(HumanBodyBones))) {
      var bone = new GameObject(name.ToString()).transform;
      bone.SetParent(root.transform, false);
      bone.localRotation = new Quaternion(kHalf, 0, 0, kHalf);
      if (name <= HumanBodyBones.RightHand) animator.Bones[name] = bone;
    }
    var humanoid = root.AddComponent<Mocap.MocapHumanoid>();
    humanoid.scale = 2.0f;
    return humanoid;
  }

  static Mocap.MocapFeed feed;
  static Mocap.MocapHumanoid humanoid;
  static Mocap.MocapProp prop;
  static Mocap.MocapMarkers markers;
  static Mocap.Samples.StickFigures figures;
  static int frames;

  static T Own<T>(object of, string name) {
    return (T)of.GetType().GetField(name, BindingFlags.Instance | BindingFlags.NonPublic).GetValue(of);
  }

  // Runs frames of the engine until the feed has what the caller waits for. False: that took too long.
  static bool Play(List<Behaviour> scene, Func<bool> until) {
    var limit = DateTime.UtcNow.AddSeconds(kLimit_s);
    for (; DateTime.UtcNow < limit; ++frames) {
      Time.unscaledTime = frames * 0.02f;
      Call(feed, "Update");
      foreach (Behaviour each in scene) Call(each, "LateUpdate");
      if (until()) return true;
      Thread.Sleep(20);  // one frame of the engine
    }
    return false;
  }

  static int Main(string[] a) {
    feed = new GameObject("Feed").AddComponent<Mocap.MocapFeed>();
    feed.endpoint = a[0];
    humanoid = Character(a[1] == "1");
    var volume = new GameObject("Volume").transform;
    volume.position = new Vector3(0, 0, 5);
    prop = new GameObject("Prop").AddComponent<Mocap.MocapProp>();
    prop.transform.SetParent(volume, false);
    markers = new GameObject("Markers").AddComponent<Mocap.MocapMarkers>();
    figures = new GameObject("Figures").AddComponent<Mocap.Samples.StickFigures>();
    var scene = new List<Behaviour> { feed, humanoid, prop, markers, figures };
    foreach (Behaviour each in scene) Call(each, "OnEnable");

    int subjects = int.Parse(a[2]);
    bool complete = Play(scene, () => feed.Frame != null && feed.Frame.Subjects.Count == subjects &&
                                      feed.Status == "all is well");
    Print();
    if (a.Length > 3) {
      bool silent = Play(scene, () => feed.Frame == null && feed.Status.StartsWith("nothing listens"));
      humanoid.GetComponent<Animator>().Bones[HumanBodyBones.Hips].position = new Vector3(7, 7, 7);  // as an Animator that plays
      foreach (Behaviour each in scene) Call(each, "LateUpdate");
      Print();
      complete = complete && silent;
    }
    foreach (Behaviour each in scene) Call(each, "OnDisable");
    return complete ? 0 : 1;
  }

  static void Print() {
    Transform hips = humanoid.GetComponent<Animator>().Bones[HumanBodyBones.Hips];
    // Removes the rotations of the character and of the rest pose.
    Quaternion turn = Quaternion.Inverse(humanoid.transform.rotation) * hips.rotation * new Quaternion(-kHalf, 0, 0, kHalf);
    var out_ = new StringBuilder("{");
    out_.Append("\"status\": " + Text(feed.Status)).Append(", \"hips\": " + Text(hips.position));
    out_.Append(", \"rotation_xyzw\": " + Text(turn)).Append(", \"humanoid\": " + Text(humanoid.Status));
    out_.Append(", \"prop\": " + Text(prop.transform.position)).Append(", \"prop_xyzw\": " + Text(prop.transform.rotation));
    out_.Append(", \"prop_status\": " + Text(prop.Status)).Append(", \"figures\": " + Text(figures.Status));
    List<GameObject> spheres = Own<List<GameObject>>(markers, "shown_");
    List<LineRenderer> lines = Own<List<LineRenderer>>(figures, "lines_");
    out_.Append(", \"prop_tracked\": " + (prop.IsTracked ? "true" : "false"));
    out_.Append(", \"shown_markers\": " + spheres.FindAll(each => each.activeSelf).Count);
    out_.Append(", \"shown_lines\": " + lines.FindAll(each => each.enabled).Count);
    out_.Append(", \"markers\": [");
    for (int i = 0; i < markers.Markers.Count; ++i) {
      Mocap.ListedMarker each = markers.Markers[i];
      out_.Append(i > 0 ? ", " : "").Append("[" + Text(each.Subject ?? "") + ", " + Text(each.Label ?? "") + ", ");
      out_.Append(Text(each.Position.X, each.Position.Y, each.Position.Z) + "]");
    }
    out_.Append("], \"log\": [" + string.Join(", ", Debug.Said.ConvertAll(said => Text(said)).ToArray()) + "]}");
    Console.WriteLine(out_);
  }
}
