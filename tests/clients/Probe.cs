// Runs the C# client for the tests; arguments and output as probe.c.
using System;
using System.Diagnostics;
using System.Globalization;
using System.Text;
using System.Threading;

static class Probe {
  static readonly StringBuilder Out = new StringBuilder("{");

  static void Say(string name, object value) {
    if (Out.Length > 1) Out.Append(", ");
    Out.Append('"').Append(name).Append("\": ").Append(string.Format(CultureInfo.InvariantCulture, "{0}", value));
  }
  static void SayText(string name, string value) { Say(name, "\"" + value + "\""); }
  static void SayAll(string name, params float[] values) {
    Say(name, "[" + string.Join(", ", Array.ConvertAll(values, v => v.ToString("R", CultureInfo.InvariantCulture))) + "]");
  }
  static void Say(string name, Mocap.Vec3 v) { SayAll(name, v.X, v.Y, v.Z); }
  static void Say(string name, Mocap.Quat q) { SayAll(name, q.X, q.Y, q.Z, q.W); }

  static void Say(Mocap.Frame frame) {
    Say("number", frame.Info.Number);
    Say("version", frame.Info.DescriptionVersion);
    SayText("session", frame.Session);
    Out.Append(", \"subjects\": [");
    for (int i = 0; i < frame.Subjects.Count; ++i) {
      Mocap.Subject subject = frame.Subjects[i];
      Out.Append(i > 0 ? ", {" : "{").Append("\"name\": \"" + subject.Name + "\"");
      SayText("bone", subject.Description.Bones[0].Name);
      if (subject.BoneCount > 0) Say(subject.BonePoses[0]);
      Out.Append("}");
    }
    Out.Append("]");
  }

  static void Say(Mocap.BonePose pose) {
    Say("position", pose.Position);
    Say("rotation_xyzw", pose.Rotation);
    Say("local_position", pose.LocalPosition);
    Say("local_rotation_xyzw", pose.LocalRotation);
    Say("velocity", pose.Velocity);
    Say("spin", pose.Spin);
  }

  static int Main(string[] a) {
    double period = 1.0 / double.Parse(a[2], CultureInfo.InvariantCulture);
    double seconds = double.Parse(a[3], CultureInfo.InvariantCulture);
    bool keys = a.Length > 6;
    var frame = new Mocap.Frame();
    long frames = 0;
    using (var client = new Mocap.Client(a[0], (Mocap.Axes)int.Parse(a[1]), "snapshot", 1, keys ? a[4] : null,
                                         keys ? a[5] : null, keys ? a[6] : null)) {
      var clock = Stopwatch.StartNew();
      for (double at = 0; at < seconds; at += period) {
        double wait = at - clock.Elapsed.TotalSeconds;
        if (wait > 0) Thread.Sleep(TimeSpan.FromSeconds(wait));
        if (client.Poll(frame)) ++frames;
      }
      string sentence;
      Mocap.Diagnosis diagnosis = client.Diagnose(out sentence);
      Mocap.Statistics s = client.Statistics;
      Say("frames", frames);
      Say("diagnosis", (int)diagnosis);
      SayText("sentence", sentence);
      Say("received", s.Received);
      Say("lost", s.Lost);
      Say("restarts", s.Restarts);
      Say("unreadable", s.Unreadable);
      Say("rate_hz", s.RateHz);
      if (s.AgeP99Ns != Mocap.Client.Absent) {
        Say("age_p50_ms", s.AgeP50Ns / 1e6);
        Say("age_p99_ms", s.AgeP99Ns / 1e6);
      }
      Say(frame);
    }
    Console.WriteLine(Out.Append("}"));
    return 0;
  }
}
