// Runs the components of the Unity package as a scene would, with stand-ins for Unity, until the feed has shown every subject.
// Prints what the scene shows, as JSON. usage: Scene.exe ENDPOINT ROOT_TURNED(0|1) SUBJECTS
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

  static int Main(string[] a) {
    var feed = new GameObject("Feed").AddComponent<Mocap.MocapFeed>();
    feed.endpoint = a[0];
    Mocap.MocapHumanoid humanoid = Character(a[1] == "1");
    var volume = new GameObject("Volume").transform;
    volume.position = new Vector3(0, 0, 5);
    var prop = new GameObject("Prop").AddComponent<Mocap.MocapProp>();
    prop.transform.SetParent(volume, false);
    var markers = new GameObject("Markers").AddComponent<Mocap.MocapMarkers>();
    var figures = new GameObject("Figures").AddComponent<Mocap.Samples.StickFigures>();
    var scene = new List<Behaviour> { feed, humanoid, prop, markers, figures };
    foreach (Behaviour each in scene) Call(each, "OnEnable");

    int subjects = int.Parse(a[2]);
    var limit = DateTime.UtcNow.AddSeconds(kLimit_s);
    bool complete = false;
    for (int frames = 0; DateTime.UtcNow < limit && !complete; ++frames) {
      Time.unscaledTime = frames * 0.02f;
      Call(feed, "Update");
      foreach (Behaviour each in scene) Call(each, "LateUpdate");
      complete = feed.Frame != null && feed.Frame.Subjects.Count == subjects && feed.Status == "all is well";
      Thread.Sleep(20);  // one frame of the engine
    }

    Transform hips = humanoid.GetComponent<Animator>().Bones[HumanBodyBones.Hips];
    // Removes the rotations of the character and of the rest pose.
    Quaternion turn = Quaternion.Inverse(humanoid.transform.rotation) * hips.rotation * new Quaternion(-kHalf, 0, 0, kHalf);
    var out_ = new StringBuilder("{");
    out_.Append("\"status\": " + Text(feed.Status)).Append(", \"hips\": " + Text(hips.position));
    out_.Append(", \"rotation_xyzw\": " + Text(turn)).Append(", \"humanoid\": " + Text(humanoid.Status));
    out_.Append(", \"prop\": " + Text(prop.transform.position)).Append(", \"prop_xyzw\": " + Text(prop.transform.rotation));
    out_.Append(", \"prop_status\": " + Text(prop.Status)).Append(", \"figures\": " + Text(figures.Status));
    out_.Append(", \"markers\": [");
    for (int i = 0; i < markers.Markers.Count; ++i) {
      Mocap.ListedMarker each = markers.Markers[i];
      out_.Append(i > 0 ? ", " : "").Append("[" + Text(each.Subject ?? "") + ", " + Text(each.Label ?? "") + ", ");
      out_.Append(Text(each.Position.X, each.Position.Y, each.Position.Z) + "]");
    }
    out_.Append("], \"log\": [" + string.Join(", ", Debug.Said.ConvertAll(said => Text(said)).ToArray()) + "]}");
    Console.WriteLine(out_);
    foreach (Behaviour each in scene) Call(each, "OnDisable");
    return complete ? 0 : 1;
  }
}
