// Prints the root position of each subject once a second. usage: mono Example.exe [ENDPOINT [SECONDS]]
using System;
using System.Diagnostics;

static class Example {
  static int Main(string[] arguments) {
    string endpoint = arguments.Length > 0 ? arguments[0] : "tcp://127.0.0.1:5570";
    double seconds = arguments.Length > 1 ? double.Parse(arguments[1]) : 10;
    var clock = Stopwatch.StartNew();
    double shown = -1;
    using (var client = new Mocap.Client(endpoint, Mocap.Axes.Unity))
    using (var frame = new Mocap.Frame()) {
      while (clock.Elapsed.TotalSeconds < seconds) {
        bool came = client.Wait(frame, 1000);
        if (came && clock.Elapsed.TotalSeconds < shown + 1) continue;
        shown = clock.Elapsed.TotalSeconds;
        if (!came) {
          string why;
          client.Diagnose(out why);
          Console.WriteLine("no data: " + why);
          continue;
        }
        foreach (Mocap.Subject subject in frame.Subjects) {
          if (subject.BoneCount == 0) continue;
          Mocap.Vec3 at = subject.BonePoses[0].Position;
          Console.WriteLine("{0}: {1}'s {2} at {3:F3} {4:F3} {5:F3}", frame.Info.Number, subject.Name,
                            subject.Description.Bones[0].Name, at.X, at.Y, at.Z);
        }
      }
      Console.WriteLine("{0:F1} Hz, {1} received, {2} lost", client.Statistics.RateHz, client.Statistics.Received,
                        client.Statistics.Lost);
    }
    return 0;
  }
}
