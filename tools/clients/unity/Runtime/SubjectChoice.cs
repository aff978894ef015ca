// Finds the subject that a component shows. Plain C# without UnityEngine.
using System;
using System.Collections.Generic;

namespace Mocap {

public static class SubjectChoice {
  /// A subject is a person if a bone has a name in HumanBodyBones.
  public static readonly Predicate<Subject> Person =
      subject => Array.Exists(subject.Description.Bones, bone => bone.UnityName.Length > 0);

  /// A prop is a rigid body: one bone, which is no bone of a person.
  public static readonly Predicate<Subject> Prop = subject => subject.Description.Bones.Length == 1 && !Person(subject);

  /// Returns the subject called `name`, or if `name` is empty the first that is `suitable`; null if there is none.
  public static Subject Find(Frame frame, string name, Predicate<Subject> suitable) {
    if (name.Length > 0) return frame.FindSubject(name);
    for (int i = 0; i < frame.Subjects.Count; ++i) {
      if (suitable(frame.Subjects[i])) return frame.Subjects[i];
    }
    return null;
  }

  /// The reason why Find returned null.
  public static string Fault(Frame frame, string name, string kind) {
    var names = new List<string>();
    foreach (Subject subject in frame.Subjects) names.Add(subject.Name);
    string present = names.Count > 0 ? "its subjects are " + string.Join(", ", names.ToArray()) : "it has no subject";
    return "no " + kind + (name.Length > 0 ? " '" + name + "'" : "") + " in the feed: " + present;
  }
}

}  // namespace Mocap
