// MocapHumanoid on stand-ins for Unity: prints what its hips became. usage: Humanoid.exe ENDPOINT ROOT_TURNED(0|1)
using System;
using System.Globalization;
using System.Reflection;
using System.Threading;
using UnityEngine;

static class Humanoid {
  static void Call(object on, string name) {
    on.GetType().GetMethod(name, BindingFlags.Instance | BindingFlags.NonPublic).Invoke(on, null);
  }

  static int Main(string[] a) {
    float s = (float)Math.Sqrt(0.5);
    var humanoid = new Mocap.MocapHumanoid { endpoint = a[0], scale = 2.0f };
    var hips = new Transform { rotation = new Quaternion(s, 0, 0, s) };  // its own axes at rest, as rigs have
    if (a[1] == "1") {
      // The character stands at (1, 0, 0), turned by 90 degrees about up, and its bones with it.
      humanoid.transform.rotation = new Quaternion(0, s, 0, s);
      humanoid.transform.position = new Vector3(1, 0, 0);
      hips.rotation = humanoid.transform.rotation * hips.rotation;
    }
    humanoid.animator.bones[HumanBodyBones.Hips] = hips;
    Call(humanoid, "OnEnable");
    for (int i = 0; i < 100; ++i) {
      Time.unscaledTime = i * 0.02f;
      Call(humanoid, "LateUpdate");
      Thread.Sleep(20);  // a frame of the engine
    }
    Call(humanoid, "OnDisable");
    Vector3 p = hips.position;
    // Out of the character's and the rest pose's turns again.
    Quaternion q = Quaternion.Inverse(humanoid.transform.rotation) * hips.rotation * new Quaternion(-s, 0, 0, s);
    Console.WriteLine(string.Format(CultureInfo.InvariantCulture,
      "{{\"position\": [{0:R}, {1:R}, {2:R}], \"rotation_xyzw\": [{3:R}, {4:R}, {5:R}, {6:R}], \"status\": \"{7}\"}}",
      p.x, p.y, p.z, q.x, q.y, q.z, q.w, humanoid.Status));
    return 0;
  }
}
