// Draws every subject of the feed as a stick figure: a line from the joint of each bone to the joint of its parent. Needs no
// character. The object is the volume: its origin, and its axes.
using System.Collections.Generic;
using UnityEngine;

namespace Mocap.Samples {

public sealed class StickFigures : MocapReceiver {
  [Tooltip("Material of the lines")]
  public Material material;
  [Tooltip("Width of the lines, m")]
  public float width = 0.02f;

  readonly List<LineRenderer> lines_ = new List<LineRenderer>();
  int used_;

  protected override void Show(Frame frame, bool isNew) {
    if (!isNew) return;
    used_ = 0;
    foreach (Subject subject in frame.Subjects) Draw(subject);
    HideUnused();
  }

  protected override void ShowNothing() {
    used_ = 0;
    HideUnused();
  }

  void HideUnused() {
    for (int i = 0; i < lines_.Count; ++i) lines_[i].enabled = i < used_;
  }

  void Draw(Subject subject) {
    for (int i = 0; i < subject.BoneCount; ++i) {
      int parent = subject.Description.Bones[i].Parent;
      if (parent < 0) continue;
      LineRenderer line = NextLine();
      line.SetPosition(0, ToUnity.Position(subject.BonePoses[parent].Position));
      line.SetPosition(1, ToUnity.Position(subject.BonePoses[i].Position));
    }
  }

  LineRenderer NextLine() {
    if (used_ == lines_.Count) lines_.Add(Create());
    return lines_[used_++];
  }

  LineRenderer Create() {
    var holder = new GameObject("bone " + lines_.Count);
    holder.transform.SetParent(transform, false);
    var line = holder.AddComponent<LineRenderer>();
    line.useWorldSpace = false;
    line.positionCount = 2;
    line.startWidth = width;
    line.endWidth = width;
    line.sharedMaterial = material;
    return line;
  }

  protected override string Describe() { return used_ + " bones"; }

  void OnDisable() {
    foreach (LineRenderer line in lines_) Destroy(line.gameObject);
    lines_.Clear();
  }
}

}  // namespace Mocap.Samples
