// Moves an object as a rigid prop of the feed moves.
using UnityEngine;

namespace Mocap {

[AddComponentMenu("Mocap/Mocap Prop")]
public sealed class MocapProp : MocapReceiver {
  [Tooltip("Name of the subject; empty: the first prop. Of a subject with several bones, the object follows the root")]
  public string subject = "";

  /// True if the newest frame has a pose of the prop, and the feed is not silent. Otherwise the object stays where it was seen last.
  public bool IsTracked { get; private set; }

  Frame frame_;
  Subject found_;

  // The parent of the object is the volume: its origin, and its axes.
  protected override void Show(Frame frame, bool isNew) {
    if (!isNew) return;
    frame_ = frame;
    found_ = SubjectChoice.Find(frame, subject, SubjectChoice.Prop);
    IsTracked = found_ != null && found_.BoneCount > 0 && found_.BonePoses[0].State != State.Lost;
    if (!IsTracked) return;
    transform.localPosition = ToUnity.Position(found_.BonePoses[0].Position);
    transform.localRotation = ToUnity.Rotation(found_.BonePoses[0].Rotation);
  }

  protected override void ShowNothing() { IsTracked = false; }

  protected override string Describe() {
    if (frame_ == null) return "no frame yet";
    if (found_ == null) return SubjectChoice.Fault(frame_, subject, "prop");
    return "'" + found_.Name + (IsTracked ? "' is tracked" : "' is not found yet");
  }

  void OnDisable() { IsTracked = false; }
}

}  // namespace Mocap
