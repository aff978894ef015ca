// A component of a project, as an imported sample, that was written for version 0.2.0 of the package.
using Mocap;

public sealed class OldReceiver : MocapReceiver {
  public bool Shown;

  protected override void Show(Frame frame, bool isNew) { Shown = true; }
  protected override string Describe() { return Shown ? "shown" : "not shown"; }
}
