// Lists the health of the cameras, or starts or stops the capture.
// usage: mono ControlExample.exe [start|stop|status] [ENDPOINT [SERVER_KEY SECRET_KEY]]
using System;

static class ControlExample {
  static string At(string[] arguments, int index, string otherwise) {
    return arguments.Length > index ? arguments[index] : otherwise;
  }

  static int Main(string[] arguments) {
    string what = At(arguments, 0, "status");
    try {
      using (var control = new Mocap.Control(At(arguments, 1, "tcp://127.0.0.1:5571"), serverKey: At(arguments, 2, null),
                                             secretKey: At(arguments, 3, null))) {
        if (what != "status") Console.WriteLine(what == "start" ? control.StartCapture() : control.StopCapture());
        Mocap.DaemonStatus status = control.Status();
        Console.WriteLine("{0}, capture {1}, you are {2}", status.Producer, status.Capturing ? "runs" : "is stopped", status.Role);
        if (status.Health == null) return 0;
        foreach (Mocap.CameraHealth camera in status.Health.Cameras) {
          Console.WriteLine("{0}: {1}, {2:F1} Hz, {3} frames {4}", camera.Name, camera.Phase, camera.RateHz, camera.Figures.Frames,
                            camera.LastError);
        }
      }
      return 0;
    } catch (Exception fault) {
      Console.Error.WriteLine("ControlExample: " + fault.Message);
      return 69;
    }
  }
}
