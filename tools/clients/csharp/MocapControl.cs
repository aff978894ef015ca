// The second part of the C# client: health and events of a daemon, and requests to it as mocapctl sends them.
//
//   using (var control = new Mocap.Control("tcp://127.0.0.1:5571")) {
//     control.StopCapture();                                   // throws ControlException with the reason
//     foreach (Mocap.CameraHealth camera in control.Status().Health.Cameras) Use(camera.Name, camera.Phase);
//   }
using System;
using System.Runtime.InteropServices;

namespace Mocap {

public enum CameraPhase { Unknown = 0, Starting = 1, Streaming = 2, Silent = 3, Reopening = 4, Ended = 5, Stopped = 6 }

public enum Stage { Unknown = 0, Receive = 1, Detect = 2, Fuse = 3, Send = 4, Total = 5 }

public enum RecordingState { Unknown = 0, Runs = 1, Ended = 2, Failed = 3 }

/// See mocap_event_kind. A kind of a later version of the daemon has its number, which is none of these.
public enum EventKind {
  Unknown = 0, SubjectFound = 1, SubjectLost = 2, DescriptionChanged = 3, CameraLost = 4, CameraBack = 5,
  TakeStarted = 6, TakeEnded = 7, TakeFailed = 8, Mark = 9
}

/// See mocap_code.
public enum Code {
  NoAnswer = 0, Done = 1, Invalid = 2, NotFound = 3, Forbidden = 4, Unsupported = 5, Timeout = 6, Failed = 7
}

/// See mocap_health_info. Counts since the start of the daemon.
[StructLayout(LayoutKind.Sequential)]
public struct HealthInfo {
  public long AtNs, UtcMinusHostNs;
  public double SetRateHz;
  public ulong Sets, CompleteSets, PassedOverSets;
  public ulong DroppedSnapshots, PassedOverSnapshots, SentSnapshots;
  internal UIntPtr CameraCount, LatencyCount, RecordingCount;
  public int HasFeed;  // 1: the following members are known
  public uint Listeners, Behind, Subscriptions;
  public ulong Connections, Disconnections, FailedHandshakes, RefusedClients, CutOff, FailedAccepts;
}

/// The numbers of mocap_camera_health. An unknown double is NaN; Synchronised and Bumped: 1 yes, 0 no, -1 unknown.
[StructLayout(LayoutKind.Sequential)]
public struct CameraFigures {
  internal IntPtr Name, LastError;
  public CameraPhase Phase;
  public int Synchronised, Bumped, ClockSource, ChunkTimes;
  public double RateHz;
  public ulong Frames, MissingFrames, FailedFrames, DroppedQueueFull, DroppedBlobs, Reopened;
  public ulong Underruns, ResentPackets, MissingPackets;
  public ulong Blobs, BlobsTooSmall, BlobsTooLarge, BlobsNotRound, BlobsTooDim, RowsGivenUp;
  public ulong RepeatedFrames, ClockLeaps;
  public double ThresholdGrey, NoiseGrey, BackgroundGrey;
  public double OffsetUs, DriftUsS, JitterUs, ClockUncertaintyUs;
  public double RigOffPx, RigTurnedRad, RigMovedM;
}

public sealed class CameraHealth {
  public string Name, LastError;
  public CameraFigures Figures;
  public CameraPhase Phase { get { return Figures.Phase; } }
  public double RateHz { get { return Figures.RateHz; } }
}

/// Over the last second.
[StructLayout(LayoutKind.Sequential)]
public struct Latency {
  public Stage Stage;
  public ulong Count;
  public long P50Ns, P99Ns, MaxNs;
}

public sealed class Recording {
  public string Path, Error;  // Error: empty unless failed
  public RecordingState State;
  public ulong SizeBytes, Records;
}

/// A report of the daemon about itself, about once a second.
public sealed class Health {
  public HealthInfo Info;
  public CameraHealth[] Cameras;
  public Latency[] Latencies;
  public Recording[] Recordings;

  // Copies the content of a handle.
  internal Health(IntPtr from) {
    Native.mocap_health_get_info(from, out Info, Native.SizeOf<HealthInfo>());
    Cameras = new CameraHealth[(int)(uint)Info.CameraCount];
    for (int i = 0; i < Cameras.Length; ++i) {
      var camera = new CameraHealth();
      Native.mocap_health_get_camera(from, Native.At(i), out camera.Figures, Native.SizeOf<CameraFigures>());
      camera.Name = Native.Text(camera.Figures.Name);
      camera.LastError = Native.Text(camera.Figures.LastError);
      Cameras[i] = camera;
    }
    Latencies = new Latency[(int)(uint)Info.LatencyCount];
    for (int i = 0; i < Latencies.Length; ++i) {
      Native.mocap_health_get_latency(from, Native.At(i), out Latencies[i], Native.SizeOf<Latency>());
    }
    Recordings = new Recording[(int)(uint)Info.RecordingCount];
    for (int i = 0; i < Recordings.Length; ++i) {
      Native.RawRecording raw;
      Native.mocap_health_get_recording(from, Native.At(i), out raw, Native.SizeOf<Native.RawRecording>());
      Recordings[i] = new Recording { Path = Native.Text(raw.Path), Error = Native.Text(raw.Error), State = raw.State,
                                      SizeBytes = raw.SizeBytes, Records = raw.Records };
    }
  }

  // Calls `fill` with a new handle; null if it does not return 1.
  internal static Health Of(Func<IntPtr, int> fill) {
    IntPtr handle = Native.mocap_health_new();
    try {
      return fill(handle) == 1 ? new Health(handle) : null;
    } finally {
      Native.mocap_health_free(handle);
    }
  }
}

/// A change of state. See mocap_event.
public sealed class Event {
  public ulong Sequence;
  public long AtNs;
  public EventKind Kind;
  public uint DescriptionVersion;
  public string Name;  // of the subject or camera; empty: none
  public string Message;
}

public sealed class SubjectStatus {
  public string Name;
  public Phase Phase;
  public bool Away;  // removed by an operator
}

public sealed class DaemonStatus {
  public string Producer, Session, Role;
  public bool Capturing;
  public SubjectStatus[] Subjects;
  public Health Health;  // null: no report yet
}

/// The daemon did not do what was requested. The message names the fault and its remedy.
public sealed class ControlException : Exception {
  public readonly Code Code;
  public readonly Diagnosis Diagnosis;  // why no answer came; Well with an answer
  internal ControlException(Code code, Diagnosis diagnosis, string message) : base(message) {
    Code = code;
    Diagnosis = diagnosis;
  }
}

internal static partial class Native {
  [StructLayout(LayoutKind.Sequential)]
  public struct RawRecording {
    public IntPtr Path, Error;
    public RecordingState State;
    public ulong SizeBytes, Records;
  }

  [StructLayout(LayoutKind.Sequential)]
  public struct RawEvent {
    public ulong Sequence;
    public long AtNs;
    public EventKind Kind;
    public uint DescriptionVersion;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 128)] public byte[] Name;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 384)] public byte[] Message;
  }

  [StructLayout(LayoutKind.Sequential)]
  public struct RawStatus {
    public IntPtr Producer, Session, Role;
    public int Capturing;
    public UIntPtr SubjectCount;
  }

  [StructLayout(LayoutKind.Sequential)]
  public struct RawSubjectStatus {
    public IntPtr Name;
    public Phase Phase;
    public int Away;
  }

  [StructLayout(LayoutKind.Sequential)]
  public struct ControlOptions {
    public UIntPtr Size;
    public IntPtr Endpoint;
    public int TimeoutMs, Axes;
    public IntPtr ServerKey, PublicKey, SecretKey;
  }

  [StructLayout(LayoutKind.Sequential)]
  public struct Request {
    public UIntPtr Size;
    public RequestKind Kind;
    public int TimeoutMs;
    public IntPtr Name, MarkerSet;
    public double ExposureUs, GainDb;
    public uint Images;
    public IntPtr RestOffsets;
    public UIntPtr RestOffsetCount;
    public IntPtr MarkerOffsets;
    public UIntPtr MarkerOffsetCount;
    public double ResidualM;
    public IntPtr Slate, Text;
    public double BeforeS, Seconds, CountdownS;
    public long AtUtcNs;
  }

  public enum RequestKind {
    Status = 1, CaptureStart = 2, CaptureStop = 3, SubjectAdd = 4, SubjectRemove = 5, SubjectReset = 6, SubjectFit = 7,
    CameraSet = 8, MaskLearn = 9, Reload = 10, TakeStart = 11, TakeStop = 12, TakeCancel = 13, TakeMark = 14, TakeNext = 15
  }

  [DllImport(Library)] public static extern IntPtr mocap_health_new();
  [DllImport(Library)] public static extern void mocap_health_free(IntPtr health);
  [DllImport(Library)] public static extern int mocap_client_get_health(IntPtr client, IntPtr into);
  [DllImport(Library)]
  public static extern int mocap_health_get_info(IntPtr health, out HealthInfo into, UIntPtr size);
  [DllImport(Library)]
  public static extern int mocap_health_get_camera(IntPtr health, UIntPtr index, out CameraFigures into, UIntPtr size);
  [DllImport(Library)]
  public static extern int mocap_health_get_latency(IntPtr health, UIntPtr index, out Latency into, UIntPtr size);
  [DllImport(Library)]
  public static extern int mocap_health_get_recording(IntPtr health, UIntPtr index, out RawRecording into, UIntPtr size);
  [DllImport(Library)] public static extern int mocap_client_next_event(IntPtr client, out RawEvent into, UIntPtr size);
  [DllImport(Library)]
  public static extern void mocap_control_options_init(ref ControlOptions options, UIntPtr size);
  [DllImport(Library)]
  public static extern IntPtr mocap_control_open(ref ControlOptions options, byte[] fault, UIntPtr size);
  [DllImport(Library)] public static extern void mocap_control_close(IntPtr control);
  [DllImport(Library)] public static extern IntPtr mocap_answer_new();
  [DllImport(Library)] public static extern void mocap_answer_free(IntPtr answer);
  [DllImport(Library)]
  public static extern void mocap_request_init(ref Request request, UIntPtr size, RequestKind kind);
  [DllImport(Library)] public static extern int mocap_control_ask(IntPtr control, ref Request request, IntPtr answer);
  [DllImport(Library)] public static extern int mocap_control_get_frame(IntPtr control, IntPtr frame, IntPtr answer);
  [DllImport(Library)] public static extern IntPtr mocap_answer_message(IntPtr answer);
  [DllImport(Library)] public static extern int mocap_answer_diagnosis(IntPtr answer);
  [DllImport(Library)] public static extern int mocap_answer_get_status(IntPtr answer, out RawStatus into, UIntPtr size);
  [DllImport(Library)]
  public static extern int mocap_answer_get_subject(IntPtr answer, UIntPtr index, out RawSubjectStatus into,
                                                    UIntPtr size);
  [DllImport(Library)] public static extern int mocap_answer_get_health(IntPtr answer, IntPtr into);
}

public sealed partial class Client {
  /// The newest health report; null if none has arrived yet.
  public Health Health {
    get {
      Health health = Health.Of(into => Native.mocap_client_get_health(Handle, into));
      GC.KeepAlive(this);
      return health;
    }
  }

  /// The oldest event that was not taken yet, or null. Never waits. The newest 256 events are kept.
  public Event NextEvent() {
    Native.RawEvent raw;
    int found = Native.mocap_client_next_event(Handle, out raw, Native.SizeOf<Native.RawEvent>());
    GC.KeepAlive(this);
    if (found != 1) return null;
    return new Event { Sequence = raw.Sequence, AtNs = raw.AtNs, Kind = raw.Kind, DescriptionVersion = raw.DescriptionVersion,
                       Name = Native.Text(raw.Name), Message = Native.Text(raw.Message) };
  }
}

/// A connection to the control endpoint of a daemon. Each method may be called from any thread, waits for the answer,
/// returns its text for the operator, and throws ControlException if the daemon refuses, or if no answer comes within the
/// timeout; without a connection after about 1 s.
public sealed class Control : IDisposable {
  IntPtr handle_;

  /// Returns immediately. Throws ArgumentException if an argument is invalid. Keys as in Client; a file of mocapctl keys
  /// new as secretKey needs no publicKey.
  public Control(string endpoint = "tcp://127.0.0.1:5571", int timeoutMs = 5000, Axes axes = Axes.Mocap,
                 string serverKey = null, string publicKey = null, string secretKey = null) {
    var options = new Native.ControlOptions();
    Native.mocap_control_options_init(ref options, Native.SizeOf<Native.ControlOptions>());
    var texts = new[] { endpoint, serverKey, publicKey, secretKey };
    IntPtr[] copies = Array.ConvertAll<string, IntPtr>(texts, Native.Utf8);
    options.Endpoint = copies[0];
    options.TimeoutMs = timeoutMs;
    options.Axes = (int)axes;
    options.ServerKey = copies[1];
    options.PublicKey = copies[2];
    options.SecretKey = copies[3];
    var fault = new byte[512];
    handle_ = Native.mocap_control_open(ref options, fault, Native.At(fault.Length));
    foreach (IntPtr copy in copies) Marshal.FreeHGlobal(copy);
    if (handle_ == IntPtr.Zero) throw new ArgumentException(Native.Text(fault));
  }

  /// For every role.
  public DaemonStatus Status() {
    DaemonStatus status = null;
    Ask(NewRequest(Native.RequestKind.Status), null, null, answer => status = ReadStatus(answer));
    return status;
  }

  /// Requests the next snapshot with all its parts, without a subscription.
  public void GetFrame(Frame into) {
    Exchange(answer => Native.mocap_control_get_frame(Handle, into.Handle, answer), null);
    GC.KeepAlive(this);
    into.Take();
  }

  public string StartCapture() { return Ask(NewRequest(Native.RequestKind.CaptureStart)); }
  /// Stops the cameras. The feed continues, and the fits of the subjects are kept.
  public string StopCapture() { return Ask(NewRequest(Native.RequestKind.CaptureStop)); }

  /// Searches for a subject again; with markerSet, an absolute path on the daemon's machine: adds a new subject.
  public string AddSubject(string name, string markerSet = null) {
    return Ask(NewRequest(Native.RequestKind.SubjectAdd), name, markerSet);
  }
  /// The subject is away: the daemon does not search for it.
  public string RemoveSubject(string name) { return Ask(NewRequest(Native.RequestKind.SubjectRemove), name); }
  /// Discards pose and fit of the subject; the next T-pose or A-pose gives them again.
  public string ResetSubject(string name) { return Ask(NewRequest(Native.RequestKind.SubjectReset), name); }

  /// Gives the subject a fit: x y z of each bone and of each marker, m, in the order of the description and the axes of
  /// the feed.
  public string FitSubject(string name, double[] restOffsetsM, double[] markerOffsetsM, double residualM = 0) {
    Native.Request request = NewRequest(Native.RequestKind.SubjectFit);
    GCHandle rest = GCHandle.Alloc(restOffsetsM, GCHandleType.Pinned);
    GCHandle markers = GCHandle.Alloc(markerOffsetsM, GCHandleType.Pinned);
    try {
      request.RestOffsets = rest.AddrOfPinnedObject();
      request.RestOffsetCount = Native.At(restOffsetsM.Length);
      request.MarkerOffsets = markers.AddrOfPinnedObject();
      request.MarkerOffsetCount = Native.At(markerOffsetsM.Length);
      request.ResidualM = residualM;
      return Ask(request, name);
    } finally {
      rest.Free();
      markers.Free();
    }
  }

  /// Sets exposure and gain until the daemon starts again; null: unchanged.
  public string SetCamera(string name, double? exposureUs = null, double? gainDb = null) {
    Native.Request request = NewRequest(Native.RequestKind.CameraSet);
    if (exposureUs.HasValue) request.ExposureUs = exposureUs.Value;
    if (gainDb.HasValue) request.GainDb = gainDb.Value;
    return Ask(request, name);
  }

  /// Masks the lights of the empty volume in the images of one camera, or of all. images: of each camera; 0: 100.
  public string LearnMask(string camera = null, int images = 0, int timeoutMs = 0) {
    Native.Request request = NewRequest(Native.RequestKind.MaskLearn, timeoutMs);
    request.Images = (uint)images;
    return Ask(request, camera);
  }

  /// The daemon reads its configuration again; what did not change continues. Nothing changes if the configuration has a fault.
  public string Reload(int timeoutMs = 0) { return Ask(NewRequest(Native.RequestKind.Reload, timeoutMs)); }

  /// Records a take. name: of the file; null: by [takes] name. beforeS: pre-roll: the take begins this long before its start
  /// time. seconds: its length; 0: until StopTake. countdownS, atUtcNs: the take starts later.
  public string StartTake(string name = null, string slate = null, string notes = null, double beforeS = 0, double seconds = 0,
                          double countdownS = 0, long atUtcNs = 0) {
    Native.Request request = NewRequest(Native.RequestKind.TakeStart);
    request.BeforeS = beforeS;
    request.Seconds = seconds;
    request.CountdownS = countdownS;
    request.AtUtcNs = atUtcNs;
    return AskTake(request, name, slate, notes);
  }
  /// Ends the take. The answer, which names the file, comes when the file is on the disk.
  public string StopTake(int timeoutMs = 30000) { return Ask(NewRequest(Native.RequestKind.TakeStop, timeoutMs)); }
  /// Ends the take and deletes its file.
  public string CancelTake() { return Ask(NewRequest(Native.RequestKind.TakeCancel)); }
  /// Writes an event with the text into the take.
  public string MarkTake(string text) { return AskTake(NewRequest(Native.RequestKind.TakeMark), null, null, text); }
  /// Ends the take, if one is recorded, and starts the next one of the same slate.
  public string NextTake(string notes = null, int timeoutMs = 30000) {
    return AskTake(NewRequest(Native.RequestKind.TakeNext, timeoutMs), null, null, notes);
  }

  public void Dispose() {
    if (handle_ != IntPtr.Zero) Native.mocap_control_close(handle_);
    handle_ = IntPtr.Zero;
    GC.SuppressFinalize(this);
  }
  ~Control() { Dispose(); }

  IntPtr Handle {
    get {
      if (handle_ == IntPtr.Zero) throw new ObjectDisposedException("Mocap.Control");
      return handle_;
    }
  }

  static Native.Request NewRequest(Native.RequestKind kind, int timeoutMs = 0) {
    var request = new Native.Request();
    Native.mocap_request_init(ref request, Native.SizeOf<Native.Request>(), kind);
    request.TimeoutMs = timeoutMs;
    return request;
  }

  string Ask(Native.Request request, string name = null, string markerSet = null, Action<IntPtr> read = null) {
    request.Name = Native.Utf8(name);
    request.MarkerSet = Native.Utf8(markerSet);
    try {
      return Exchange(answer => Native.mocap_control_ask(Handle, ref request, answer), read);
    } finally {
      GC.KeepAlive(this);
      Marshal.FreeHGlobal(request.Name);
      Marshal.FreeHGlobal(request.MarkerSet);
    }
  }

  string AskTake(Native.Request request, string name, string slate, string text) {
    request.Slate = Native.Utf8(slate);
    request.Text = Native.Utf8(text);
    try {
      return Ask(request, name);
    } finally {
      Marshal.FreeHGlobal(request.Slate);
      Marshal.FreeHGlobal(request.Text);
    }
  }

  // Calls `ask` with a new answer. Returns its message after `read`, or throws.
  static string Exchange(Func<IntPtr, int> ask, Action<IntPtr> read) {
    IntPtr answer = Native.mocap_answer_new();
    try {
      var code = (Code)ask(answer);
      string message = Native.Text(Native.mocap_answer_message(answer));
      if (code != Code.Done) throw new ControlException(code, (Diagnosis)Native.mocap_answer_diagnosis(answer), message);
      if (read != null) read(answer);
      return message;
    } finally {
      Native.mocap_answer_free(answer);
    }
  }

  static DaemonStatus ReadStatus(IntPtr answer) {
    Native.RawStatus raw;
    Native.mocap_answer_get_status(answer, out raw, Native.SizeOf<Native.RawStatus>());
    var status = new DaemonStatus {
      Producer = Native.Text(raw.Producer),
      Session = Native.Text(raw.Session),
      Role = Native.Text(raw.Role),
      Capturing = raw.Capturing != 0,
      Subjects = new SubjectStatus[(int)(uint)raw.SubjectCount],
      Health = Health.Of(into => Native.mocap_answer_get_health(answer, into))
    };
    for (int i = 0; i < status.Subjects.Length; ++i) {
      Native.RawSubjectStatus subject;
      Native.mocap_answer_get_subject(answer, Native.At(i), out subject, Native.SizeOf<Native.RawSubjectStatus>());
      status.Subjects[i] = new SubjectStatus { Name = Native.Text(subject.Name), Phase = subject.Phase,
                                               Away = subject.Away != 0 };
    }
    return status;
  }
}

}  // namespace Mocap
