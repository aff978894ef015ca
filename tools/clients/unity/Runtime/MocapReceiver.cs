// What the components that use a feed have in common.
using UnityEngine;

namespace Mocap {

public abstract class MocapReceiver : MonoBehaviour {
  [Tooltip("The connection; empty: the first Mocap Feed of the scene")]
  public MocapFeed feed;

  /// The reason why the component shows nothing, or the state without a fault, in one line.
  public string Status { get { return obstacle_ ?? Describe(); } }

  string obstacle_;
  ulong seen_;

  /// Shows a frame. Called once in each LateUpdate while the feed has a frame, also if no newer frame arrived.
  protected abstract void Show(Frame frame, bool isNew);

  /// Shows that there is no frame. Called instead of Show in each LateUpdate before the first frame, and while the feed is
  /// silent. Without an override the component keeps what it showed last: a receiver of version 0.2.0 has none.
  protected virtual void ShowNothing() { }

  /// The state, in one line. Only called if somebody reads Status, so that a frame makes no garbage.
  protected abstract string Describe();

  // Runs after the Animator, so that the Animator does not overwrite the pose.
  protected void LateUpdate() {
    MocapFeed source = feed != null ? feed : MocapFeed.First;
    if (source == null) {
      Stop("no Mocap Feed in the scene: add the component Mocap Feed to an object");
      return;
    }
    if (source.Frame == null) {
      Stop(source.Status);
      return;
    }
    obstacle_ = null;
    Show(source.Frame, source.Count != seen_);
    seen_ = source.Count;
  }

  void Stop(string obstacle) {
    obstacle_ = obstacle;
    seen_ = 0;  // the next frame is new, also if the feed counts from the start again
    ShowNothing();
  }
}

}  // namespace Mocap
