// C# client for the feed of a mocapd: P/Invoke on libmocap_client. C# 5, no unsafe code, for Mono, .NET and Unity.
//
//   using (var client = new Mocap.Client("tcp://127.0.0.1:5570", Mocap.Axes.Unity)) {
//     var frame = new Mocap.Frame();
//     if (client.Poll(frame)) Use(frame.FindSubject("actor"));
//   }
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;

namespace Mocap {

/// The axes of positions and rotations.
public enum Axes { Mocap = 0, Unity = 1, Unreal = 2, Godot = 3, Gltf = 4 }

public enum Phase { Searching = 1, Tracking = 2, Lost = 3 }

/// State of a bone or a marker.
public enum State { Lost = 1, Measured = 2, Filled = 3 }

/// The reason why no data arrives; Well: no fault.
public enum Diagnosis {
  Well = 0, NothingListens = 1, NotAFeed = 2, KeyMissing = 3, KeyRefused = 4, ServerKeyWrong = 5, NoDescription = 6,
  VersionTooNew = 7, CamerasSilent = 8, NoSnapshots = 9, SubjectSearching = 10, ClockSkew = 11, Connecting = 12,
  NoAnswer = 13
}

[StructLayout(LayoutKind.Sequential)]
public struct Vec3 { public float X, Y, Z; }

[StructLayout(LayoutKind.Sequential)]
public struct Quat { public float X, Y, Z, W; }

/// One bone at one instant. See mocap_bone_pose.
[StructLayout(LayoutKind.Sequential)]
public struct BonePose {
  public Vec3 Position;
  public Quat Rotation;
  public Vec3 LocalPosition;
  public Quat LocalRotation;
  public Vec3 Velocity;
  public Vec3 Spin;
  public float Confidence;
  public State State;
}

/// One labelled marker at one instant. See mocap_marker_pose.
[StructLayout(LayoutKind.Sequential)]
public struct MarkerPose {
  public Vec3 Position;
  public float ResidualPx;
  public float Confidence;
  public uint Cameras;
  public uint Track;
  public State State;
}

/// An unlabelled marker. See mocap_point.
[StructLayout(LayoutKind.Sequential)]
public struct Point {
  public Vec3 Position;
  public float ResidualPx;
  public uint Cameras;
  public uint Track;
}

/// See mocap_frame_info. An unknown instant is Client.Absent.
[StructLayout(LayoutKind.Sequential)]
public struct FrameInfo {
  public ulong Number, Sequence;
  public uint DescriptionVersion, SubjectCount, PointCount, Cameras, ExpectedCameras, Synchronised;
  public long ExposedAtNs, ReceivedAtNs, DetectedAtNs, FusedAtNs, SentAtNs, UtcMinusHostNs;
  public uint TimecodeRate;
  public byte TimecodeHours, TimecodeMinutes, TimecodeSeconds, TimecodeFrames;
  public uint TimecodeDropFrame, TimecodeSubframe;
}

/// See mocap_statistics.
[StructLayout(LayoutKind.Sequential)]
public struct Statistics {
  public ulong Received, Lost, Skipped, Unreadable, Restarts, Connections, Bytes;
  public double RateHz;
  public long AgeNs, AgeP50Ns, AgeP99Ns;
}

/// Description of a bone. Strings are empty if the bone has no such name.
public sealed class Bone {
  public string Name, UnityName, UnrealName, VrmName;
  public int Parent;  // -1: the root
  public Vec3 RestOffset;
}

/// Description of a subject. The same object in all frames until the daemon sends a new description.
public sealed class SubjectDescription {
  public string Name;
  public Bone[] Bones;
  public string[] Markers;
}

/// One subject of a frame. The next Poll with the same frame overwrites its arrays.
public sealed class Subject {
  public SubjectDescription Description;
  public Phase Phase;
  public int BoneCount;  // number of valid BonePoses; 0 while the subject is not tracked
  public BonePose[] BonePoses = new BonePose[0];
  public int MarkerCount;
  public MarkerPose[] MarkerPoses = new MarkerPose[0];
  public string Name { get { return Description.Name; } }
  internal Frame Owner;
  internal UIntPtr Index;

  /// The index of a bone in BonePoses and Description.Bones. Throws KeyNotFoundException, with the names that exist.
  public int BoneIndex(string name) {
    return Find((byte[] utf8, byte[] fault) =>
        Native.mocap_frame_find_bone(Owner.Handle, Index, utf8, fault, Native.At(fault.Length)), name);
  }
  public int MarkerIndex(string name) {
    return Find((byte[] utf8, byte[] fault) =>
        Native.mocap_frame_find_marker(Owner.Handle, Index, utf8, fault, Native.At(fault.Length)), name);
  }

  /// Throws as BoneIndex, and InvalidOperationException while the subject has no poses (BoneCount is 0).
  public BonePose Bone(string name) {
    int index = BoneIndex(name);
    if (BoneCount == 0) throw NotTracked("bones");
    return BonePoses[index];
  }
  public MarkerPose Marker(string name) {
    int index = MarkerIndex(name);
    if (MarkerCount == 0) throw NotTracked("markers");
    return MarkerPoses[index];
  }

  int Find(Func<byte[], byte[], int> find, string name) {
    var fault = new byte[4096];
    int index = find(Encoding.UTF8.GetBytes(name + "\0"), fault);
    GC.KeepAlive(Owner);
    if (index < 0) throw new KeyNotFoundException(Native.Text(fault));
    return index;
  }
  Exception NotTracked(string what) {
    return new InvalidOperationException("'" + Name + "' is " + Phase.ToString().ToLowerInvariant() + ": its " + what +
                                         " have no positions now");
  }
}

internal static partial class Native {
  const string Library = "mocap_client";
  public const int Abi = 1;

  [StructLayout(LayoutKind.Sequential)]
  public struct Options {
    public UIntPtr Size;
    public IntPtr Endpoint, Topic;
    public int Axes, Keep;
    public IntPtr ServerKey, PublicKey, SecretKey;
  }

  [DllImport(Library)] public static extern int mocap_client_abi();
  [DllImport(Library)] public static extern void mocap_client_options_init(ref Options options, UIntPtr size);
  [DllImport(Library)] public static extern IntPtr mocap_client_open(ref Options options, byte[] fault, UIntPtr size);
  [DllImport(Library)] public static extern void mocap_client_close(IntPtr client);
  [DllImport(Library)] public static extern IntPtr mocap_frame_new();
  [DllImport(Library)] public static extern void mocap_frame_free(IntPtr frame);
  [DllImport(Library)] public static extern int mocap_client_poll(IntPtr client, IntPtr frame);
  [DllImport(Library)] public static extern int mocap_client_wait(IntPtr client, IntPtr frame, int timeoutMs);
  [DllImport(Library)]
  public static extern int mocap_client_get_statistics(IntPtr client, out Statistics into, UIntPtr size);
  [DllImport(Library)] public static extern int mocap_client_diagnose(IntPtr client, byte[] sentence, UIntPtr size);
  [DllImport(Library)] public static extern void mocap_frame_get_info(IntPtr frame, out FrameInfo into, UIntPtr size);
  [DllImport(Library)] public static extern long mocap_frame_age_ns(IntPtr frame);
  [DllImport(Library)] public static extern IntPtr mocap_frame_session(IntPtr frame);
  [DllImport(Library)]
  public static extern UIntPtr mocap_frame_copy_bone_poses(IntPtr frame, UIntPtr subject, [Out] BonePose[] into,
                                                           UIntPtr capacity);
  [DllImport(Library)]
  public static extern UIntPtr mocap_frame_copy_marker_poses(IntPtr frame, UIntPtr subject, [Out] MarkerPose[] into,
                                                             UIntPtr capacity);
  [DllImport(Library)]
  public static extern UIntPtr mocap_frame_copy_points(IntPtr frame, [Out] Point[] into, UIntPtr capacity);
  [DllImport(Library)] public static extern UIntPtr mocap_frame_bone_count(IntPtr frame, UIntPtr subject);
  [DllImport(Library)] public static extern UIntPtr mocap_frame_marker_count(IntPtr frame, UIntPtr subject);
  [DllImport(Library)] public static extern IntPtr mocap_frame_subject_name(IntPtr frame, UIntPtr subject);
  [DllImport(Library)] public static extern int mocap_frame_subject_phase(IntPtr frame, UIntPtr subject);
  [DllImport(Library)]
  public static extern IntPtr mocap_frame_bone_text(IntPtr frame, UIntPtr subject, UIntPtr bone, int what);
  [DllImport(Library)] public static extern int mocap_frame_bone_parent(IntPtr frame, UIntPtr subject, UIntPtr bone);
  [DllImport(Library)]
  public static extern void mocap_frame_bone_rest_offset(IntPtr frame, UIntPtr subject, UIntPtr bone, out Vec3 into);
  [DllImport(Library)]
  public static extern int mocap_frame_find_bone(IntPtr frame, UIntPtr subject, byte[] name, byte[] fault, UIntPtr size);
  [DllImport(Library)]
  public static extern int mocap_frame_find_marker(IntPtr frame, UIntPtr subject, byte[] name, byte[] fault,
                                                   UIntPtr size);
  [DllImport(Library)]
  public static extern IntPtr mocap_frame_marker_name(IntPtr frame, UIntPtr subject, UIntPtr marker);

  public static UIntPtr SizeOf<T>() { return (UIntPtr)(uint)Marshal.SizeOf(typeof(T)); }
  public static UIntPtr At(int index) { return (UIntPtr)(uint)index; }

  public static string Text(IntPtr utf8) {
    int length = 0;
    while (Marshal.ReadByte(utf8, length) != 0) ++length;
    var bytes = new byte[length];
    Marshal.Copy(utf8, bytes, 0, length);
    return Encoding.UTF8.GetString(bytes);
  }

  public static string Text(byte[] utf8) {
    int length = Array.IndexOf(utf8, (byte)0);
    return Encoding.UTF8.GetString(utf8, 0, length < 0 ? utf8.Length : length);
  }

  // Converts a string for the C library. NULL for null. Free the result with Marshal.FreeHGlobal.
  public static IntPtr Utf8(string text) {
    if (text == null) return IntPtr.Zero;
    byte[] bytes = Encoding.UTF8.GetBytes(text + "\0");
    IntPtr copy = Marshal.AllocHGlobal(bytes.Length);
    Marshal.Copy(bytes, 0, copy, bytes.Length);
    return copy;
  }
}

/// Owns one frame. Repeated polls reuse its memory. Use from one thread at a time.
public sealed class Frame : IDisposable {
  IntPtr handle_ = Native.mocap_frame_new();
  readonly List<Subject> subjects_ = new List<Subject>();
  readonly Dictionary<string, SubjectDescription> described_ = new Dictionary<string, SubjectDescription>();
  string session_ = "";
  uint version_;
  Point[] points_ = new Point[0];

  internal IntPtr Handle {
    get {
      if (handle_ == IntPtr.Zero) throw new ObjectDisposedException("Mocap.Frame");
      return handle_;
    }
  }

  public FrameInfo Info { get; private set; }
  public string Session { get { return session_; } }
  public IList<Subject> Subjects { get { return subjects_; } }
  /// The first Info.PointCount elements are unlabelled markers.
  public Point[] Points { get { return points_; } }

  /// Time from the exposure to now, ns; Client.Absent if unknown.
  public long AgeNs {
    get {
      long age = Native.mocap_frame_age_ns(Handle);
      GC.KeepAlive(this);
      return age;
    }
  }

  public Subject FindSubject(string name) {
    foreach (Subject subject in subjects_) {
      if (subject.Name == name) return subject;
    }
    return null;
  }

  public void Dispose() {
    if (handle_ != IntPtr.Zero) Native.mocap_frame_free(handle_);
    handle_ = IntPtr.Zero;
    GC.SuppressFinalize(this);
  }
  ~Frame() { Dispose(); }

  // Copies the content of the handle into this object.
  internal void Take() {
    FrameInfo info;
    Native.mocap_frame_get_info(Handle, out info, Native.SizeOf<FrameInfo>());
    string session = Native.Text(Native.mocap_frame_session(Handle));
    if (info.DescriptionVersion != version_ || session != session_) described_.Clear();
    version_ = info.DescriptionVersion;
    session_ = session;
    Info = info;
    while (subjects_.Count > info.SubjectCount) subjects_.RemoveAt(subjects_.Count - 1);
    while (subjects_.Count < info.SubjectCount) subjects_.Add(new Subject());
    for (int i = 0; i < subjects_.Count; ++i) Take(subjects_[i], Native.At(i));
    if (points_.Length < info.PointCount) points_ = new Point[info.PointCount];
    Native.mocap_frame_copy_points(Handle, points_, Native.At(points_.Length));
    GC.KeepAlive(this);
  }

  void Take(Subject into, UIntPtr index) {
    into.Owner = this;
    into.Index = index;
    into.Description = Describe(index);
    into.Phase = (Phase)Native.mocap_frame_subject_phase(Handle, index);
    if (into.BonePoses.Length < into.Description.Bones.Length) {
      into.BonePoses = new BonePose[into.Description.Bones.Length];
    }
    into.BoneCount = (int)(uint)Native.mocap_frame_copy_bone_poses(Handle, index, into.BonePoses,
                                                                   Native.At(into.BonePoses.Length));
    if (into.MarkerPoses.Length < into.Description.Markers.Length) {
      into.MarkerPoses = new MarkerPose[into.Description.Markers.Length];
    }
    into.MarkerCount = (int)(uint)Native.mocap_frame_copy_marker_poses(Handle, index, into.MarkerPoses,
                                                                       Native.At(into.MarkerPoses.Length));
  }

  SubjectDescription Describe(UIntPtr index) {
    string name = Native.Text(Native.mocap_frame_subject_name(Handle, index));
    SubjectDescription known;
    if (described_.TryGetValue(name, out known)) return known;
    var made = new SubjectDescription {
      Name = name,
      Bones = new Bone[(int)(uint)Native.mocap_frame_bone_count(Handle, index)],
      Markers = new string[(int)(uint)Native.mocap_frame_marker_count(Handle, index)]
    };
    for (int i = 0; i < made.Bones.Length; ++i) {
      var bone = new Bone {
        Name = Native.Text(Native.mocap_frame_bone_text(Handle, index, Native.At(i), 0)),
        UnityName = Native.Text(Native.mocap_frame_bone_text(Handle, index, Native.At(i), 1)),
        UnrealName = Native.Text(Native.mocap_frame_bone_text(Handle, index, Native.At(i), 2)),
        VrmName = Native.Text(Native.mocap_frame_bone_text(Handle, index, Native.At(i), 3)),
        Parent = Native.mocap_frame_bone_parent(Handle, index, Native.At(i))
      };
      Native.mocap_frame_bone_rest_offset(Handle, index, Native.At(i), out bone.RestOffset);
      made.Bones[i] = bone;
    }
    for (int i = 0; i < made.Markers.Length; ++i) {
      made.Markers[i] = Native.Text(Native.mocap_frame_marker_name(Handle, index, Native.At(i)));
    }
    described_[name] = made;
    return made;
  }
}

// A native call does not keep the object alive whose handle it uses: without GC.KeepAlive after the call, the finalizer could
// free the handle during the call.

/// A connection to a feed. Reconnects automatically. Each method may be called from any thread.
public sealed partial class Client : IDisposable {
  public const long Absent = long.MinValue;
  IntPtr handle_;

  /// Returns immediately; the daemon need not run yet. Throws ArgumentException if an argument is invalid. Keys are
  /// CURVE keys, each 40 characters of Z85 or a file of mocapctl keys new. With such a file as secretKey, publicKey may be
  /// null. All null: no encryption.
  public Client(string endpoint = "tcp://127.0.0.1:5570", Axes axes = Axes.Mocap, string topic = "snapshot", int keep = 1,
                string serverKey = null, string publicKey = null, string secretKey = null) {
    if (Native.mocap_client_abi() != Native.Abi) {
      throw new DllNotFoundException("libmocap_client has ABI " + Native.mocap_client_abi() + ", expected " + Native.Abi);
    }
    var options = new Native.Options();
    Native.mocap_client_options_init(ref options, Native.SizeOf<Native.Options>());
    var texts = new[] { endpoint, topic, serverKey, publicKey, secretKey };
    IntPtr[] copies = Array.ConvertAll<string, IntPtr>(texts, Native.Utf8);
    options.Endpoint = copies[0];
    options.Topic = copies[1];
    options.Axes = (int)axes;
    options.Keep = keep;
    options.ServerKey = copies[2];
    options.PublicKey = copies[3];
    options.SecretKey = copies[4];
    var fault = new byte[256];
    handle_ = Native.mocap_client_open(ref options, fault, Native.At(fault.Length));
    foreach (IntPtr copy in copies) Marshal.FreeHGlobal(copy);
    if (handle_ == IntPtr.Zero) throw new ArgumentException(Native.Text(fault));
  }

  IntPtr Handle {
    get {
      if (handle_ == IntPtr.Zero) throw new ObjectDisposedException("Mocap.Client");
      return handle_;
    }
  }

  /// Returns true if the frame was replaced by a newer frame. Never waits.
  public bool Poll(Frame frame) {
    int result = Native.mocap_client_poll(Handle, frame.Handle);
    GC.KeepAlive(this);
    return Took(result, frame);
  }

  /// Like Poll, but waits for the next frame. Do not use in a render thread.
  public bool Wait(Frame frame, int timeoutMs) {
    int result = Native.mocap_client_wait(Handle, frame.Handle, timeoutMs);
    GC.KeepAlive(this);
    return Took(result, frame);
  }

  static bool Took(int result, Frame frame) {
    if (result == 1) frame.Take();
    GC.KeepAlive(frame);
    return result == 1;
  }

  public Statistics Statistics {
    get {
      Statistics into;
      Native.mocap_client_get_statistics(Handle, out into, Native.SizeOf<Statistics>());
      GC.KeepAlive(this);
      return into;
    }
  }

  /// The reason why no data arrives, and a remedy, in one line.
  public Diagnosis Diagnose(out string sentence) {
    var text = new byte[512];
    int code = Native.mocap_client_diagnose(Handle, text, Native.At(text.Length));
    GC.KeepAlive(this);
    sentence = Native.Text(text);
    return (Diagnosis)code;
  }

  public void Dispose() {
    if (handle_ != IntPtr.Zero) Native.mocap_client_close(handle_);
    handle_ = IntPtr.Zero;
    GC.SuppressFinalize(this);
  }
  ~Client() { Dispose(); }
}

}  // namespace Mocap
