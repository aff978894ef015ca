// Lists the markers of a frame. Plain C# without UnityEngine.
using System.Collections.Generic;

namespace Mocap {

/// One marker that has a position in the frame, in Unity's axes.
public struct ListedMarker {
  public string Subject;  // null: unlabelled
  public string Label;    // null: unlabelled
  public uint Track;      // constant while an unlabelled marker is tracked; 0: none
  public Vec3 Position;
  public bool IsMeasured;  // false: predicted by the body model
}

public static class MarkerList {
  /// Fills `into` with the labelled markers of the subject called `subject` (empty: of all), then the unlabelled ones.
  public static void Read(Frame frame, string subject, bool labelled, bool unlabelled, List<ListedMarker> into) {
    into.Clear();
    if (labelled) {
      foreach (Subject each in frame.Subjects) {
        if (subject.Length == 0 || each.Name == subject) Add(each, into);
      }
    }
    uint points = unlabelled ? frame.Info.PointCount : 0;
    for (int i = 0; i < points; ++i) {
      Point point = frame.Points[i];
      into.Add(new ListedMarker { Track = point.Track, Position = point.Position, IsMeasured = true });
    }
  }

  static void Add(Subject subject, List<ListedMarker> into) {
    for (int i = 0; i < subject.MarkerCount; ++i) {
      MarkerPose pose = subject.MarkerPoses[i];
      if (pose.State == State.Lost) continue;
      into.Add(new ListedMarker {
        Subject = subject.Name,
        Label = subject.Description.Markers[i],
        Track = pose.Track,
        Position = pose.Position,
        IsMeasured = pose.State == State.Measured
      });
    }
  }
}

}  // namespace Mocap
