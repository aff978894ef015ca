// Inspectors that show the state of a component below its settings: in play mode of the connection, before it of the
// character.
using UnityEditor;
using UnityEngine;

namespace Mocap {

[CustomEditor(typeof(MocapFeed))]
public sealed class MocapFeedInspector : Editor {
  public override void OnInspectorGUI() {
    DrawDefaultInspector();
    var feed = (MocapFeed)target;
    if (Application.isPlaying) StatusBox.Show(feed.Status);
  }
  public override bool RequiresConstantRepaint() { return Application.isPlaying; }
}

[CustomEditor(typeof(MocapReceiver), true)]
public sealed class MocapReceiverInspector : Editor {
  public override void OnInspectorGUI() {
    DrawDefaultInspector();
    var receiver = (MocapReceiver)target;
    if (Application.isPlaying) {
      StatusBox.Show(receiver.Status);
    } else if (receiver is MocapHumanoid) {
      StatusBox.Show(HumanoidCheck.Fault(receiver.GetComponent<Animator>()));
    }
  }
  public override bool RequiresConstantRepaint() { return Application.isPlaying; }
}

static class StatusBox {
  public static void Show(string text) {
    if (!string.IsNullOrEmpty(text)) EditorGUILayout.HelpBox(text, MessageType.Info);
  }
}

}  // namespace Mocap
