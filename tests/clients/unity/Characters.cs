// Prints, one a line, what HumanoidCheck says about characters with one fault each, with stand-ins for Unity.
using System;
using UnityEngine;

static class Characters {
  static Animator Whole() {
    var animator = new GameObject("Character").AddComponent<Animator>();
    animator.avatar = new Avatar { name = "Hero", isValid = true, isHuman = true };
    foreach (HumanBodyBones name in Enum.GetValues(typeof(HumanBodyBones))) {
      if (name != HumanBodyBones.LastBone) animator.Bones[name] = new GameObject(name.ToString()).transform;
    }
    animator.Bones[HumanBodyBones.LeftLowerArm].position = new Vector3(-0.3f, 0, 0);
    animator.Bones[HumanBodyBones.RightLowerArm].position = new Vector3(0.3f, 0, 0);
    return animator;
  }

  static void Say(string name, string said) { Console.WriteLine(name + ": " + said); }

  static int Main() {
    Say("whole", Mocap.HumanoidCheck.Fault(Whole()) + Mocap.HumanoidCheck.PoseFault(Whole()));
    Say("no animator", Mocap.HumanoidCheck.Fault(null));
    Animator one = Whole();
    one.avatar = null;
    Say("no avatar", Mocap.HumanoidCheck.Fault(one));
    one.avatar = new Avatar { name = "Hero", isHuman = true };
    Say("invalid", Mocap.HumanoidCheck.Fault(one));
    one.avatar = new Avatar { name = "Hero", isValid = true };
    Say("generic", Mocap.HumanoidCheck.Fault(one));
    one = Whole();
    one.Bones.Remove(HumanBodyBones.LeftHand);
    one.Bones.Remove(HumanBodyBones.Head);
    one.Bones.Remove(HumanBodyBones.Jaw);  // a humanoid needs no jaw
    Say("missing", Mocap.HumanoidCheck.Fault(one));
    one = Whole();
    one.Bones[HumanBodyBones.RightLowerArm].position = new Vector3(0.3f, -0.3f, 0);
    Say("A-pose", Mocap.HumanoidCheck.PoseFault(one));

    one = Whole();
    one.avatar = null;
    var humanoid = one.gameObject.AddComponent<Mocap.MocapHumanoid>();
    var enable = typeof(Mocap.MocapHumanoid).GetMethod(
        "OnEnable", System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic);
    enable.Invoke(humanoid, null);
    Say("component", humanoid.enabled + ", " + humanoid.Status + ", " + Debug.Said.Count + " message");
    return 0;
  }
}
