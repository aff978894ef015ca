// Runs the C# client's control, health and events for the tests; arguments, commands and output as control_probe.c.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;

static class ControlProbe {
  static Mocap.Control control;
  static Mocap.Client client;
  static readonly Mocap.Frame frame = new Mocap.Frame();

  static string Quoted(string text) {
    return "\"" + text.Replace("\\", "\\\\").Replace("\"", "\\\"").Replace("\n", "\\n") + "\"";
  }
  static string Joined(IEnumerable<string> parts) { return "[" + string.Join(", ", parts) + "]"; }

  static string Cameras(Mocap.Health health) {
    if (health == null) return "[]";
    return Joined(health.Cameras.Select(camera => string.Format("{{\"name\": {0}, \"phase\": {1}, \"frames\": {2}}}",
                                                                Quoted(camera.Name), (int)camera.Phase, camera.Figures.Frames)));
  }

  static string Answer(Mocap.Code code, Mocap.Diagnosis diagnosis, string message) {
    return string.Format("\"code\": {0}, \"diagnosis\": {1}, \"message\": {2}", (int)code, (int)diagnosis, Quoted(message));
  }
  static string Done(string message) { return Answer(Mocap.Code.Done, Mocap.Diagnosis.Well, message); }

  static string Status() {
    Mocap.DaemonStatus status = control.Status();
    string subjects = Joined(status.Subjects.Select(
        one => string.Format("{{\"name\": {0}, \"phase\": {1}, \"away\": {2}}}", Quoted(one.Name), (int)one.Phase, one.Away ? 1 : 0)));
    return Done("") + string.Format(", \"capturing\": {0}, \"role\": {1}, \"subjects\": {2}, \"cameras\": {3}",
                                    status.Capturing ? 1 : 0, Quoted(status.Role), subjects, Cameras(status.Health));
  }

  static string Frame() {
    control.GetFrame(frame);
    return Done("") + ", \"bones\": " + frame.Subjects[0].Description.Bones.Length;
  }

  static string Health() {
    Mocap.Health health = client.Health;
    return string.Format("\"sets\": {0}, \"cameras\": {1}", health == null ? 0 : health.Info.Sets, Cameras(health));
  }

  static string Events() {
    var events = new List<string>();
    for (Mocap.Event one = client.NextEvent(); one != null; one = client.NextEvent()) {
      events.Add(string.Format("{{\"kind\": {0}, \"name\": {1}}}", (int)one.Kind, Quoted(one.Name)));
    }
    return "\"events\": " + Joined(events);
  }

  static string Find(string what, string name) {
    client.Wait(frame, 10000);
    Mocap.Subject subject = frame.Subjects[0];
    try {
      int index = what == "bone" ? subject.BoneIndex(name) : subject.MarkerIndex(name);
      return "\"index\": " + index + ", \"fault\": \"\"";
    } catch (KeyNotFoundException fault) {
      return "\"index\": -1, \"fault\": " + Quoted(fault.Message);
    }
  }

  static double[] Numbers(string list) {
    return list.Split(',').Select(one => double.Parse(one, CultureInfo.InvariantCulture)).ToArray();
  }
  static double? Optional(string word) {
    return word == "-" ? (double?)null : double.Parse(word, CultureInfo.InvariantCulture);
  }

  static string Run(string[] words) {
    switch (words[0]) {
      case "health": return Health();
      case "events": return Events();
      case "bone":
      case "marker": return Find(words[0], words[1]);
      case "status": return Status();
      case "frame": return Frame();
      case "start": return Done(control.StartCapture());
      case "stop": return Done(control.StopCapture());
      case "add": return Done(control.AddSubject(words[1], words.Length > 2 ? words[2] : null));
      case "remove": return Done(control.RemoveSubject(words[1]));
      case "reset": return Done(control.ResetSubject(words[1]));
      case "fit": return Done(control.FitSubject(words[1], Numbers(words[2]), Numbers(words[3]), 0.001));
      case "camera": return Done(control.SetCamera(words[1], Optional(words[2]), Optional(words[3])));
      case "mask": return Done(control.LearnMask(words[1] == "-" ? null : words[1], int.Parse(words[2]), 60000));
      case "take-start": return Done(control.StartTake(words[1], notes: words.Length > 2 ? words[2] : null));
      case "take-stop": return Done(control.StopTake(60000));
      case "take-cancel": return Done(control.CancelTake());
      case "take-mark": return Done(control.MarkTake(words[2]));
      case "take-next": return Done(control.NextTake(timeoutMs: 60000));
      default: return Done(control.Reload());
    }
  }

  static int Main(string[] a) {
    string server = a[2] == "-" ? null : a[2];
    string secret = a[3] == "-" ? null : a[3];
    using (control = new Mocap.Control(a[0], serverKey: server, secretKey: secret))
    using (client = new Mocap.Client(a[1], serverKey: server, secretKey: secret)) {
      for (string line = Console.ReadLine(); line != null; line = Console.ReadLine()) {
        string said;
        try {
          said = Run(line.Split(' '));
        } catch (Mocap.ControlException fault) {
          said = Answer(fault.Code, fault.Diagnosis, fault.Message);
        }
        Console.WriteLine("{" + said + "}");
      }
    }
    return 0;
  }
}
