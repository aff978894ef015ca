// The connection to the feed of one mocapd. Add one to any object of the scene; the other components use it.
using System;
using System.Collections.Generic;
using UnityEngine;

namespace Mocap {

[AddComponentMenu("Mocap/Mocap Feed")]
[DefaultExecutionOrder(-100)]  // a frame that arrives is used in the same Update
[DisallowMultipleComponent]
public sealed class MocapFeed : MonoBehaviour {
  [Tooltip("tcp://ADDRESS:PORT of the daemon's feed")]
  public string endpoint = "tcp://127.0.0.1:5570";
  [Tooltip("Public key of the daemon: 40 characters, or a file with the key; empty: no encryption")]
  public string serverKey = "";
  [Tooltip("A file of `mocapctl keys new`, or the secret key: 40 characters")]
  public string secretKey = "";
  [Tooltip("Only if Secret Key is not a file: the public key that belongs to it")]
  public string publicKey = "";

  /// The reason why no data arrives, or the state without a fault, in one line.
  public string Status { get; private set; }
  /// The newest frame; null before the first, and if none came for a second.
  public Frame Frame { get; private set; }
  /// Number of frames received since the component was enabled. A reader compares it to find a new frame.
  public ulong Count { get; private set; }
  /// Counts since the component was enabled.
  public Statistics Statistics { get { return client_ != null ? client_.Statistics : new Statistics(); } }

  /// The first enabled feed of the scene, or null.
  public static MocapFeed First { get { return running_.Count > 0 ? running_[0] : null; } }

  const float kSilence_s = 1.0f;  // as in the diagnosis of the client

  static readonly List<MocapFeed> running_ = new List<MocapFeed>();
  Client client_;
  Frame buffer_;
  float nextStatus_, lastFrame_;

  void OnEnable() {
    Count = 0;
    nextStatus_ = 0;
    try {
      buffer_ = new Frame();
      client_ = new Client(endpoint, Axes.Unity, "snapshot", 1, serverKey, publicKey, secretKey);
      running_.Add(this);
    } catch (Exception fault) {  // an invalid option, or no native library for this platform
      Status = fault.Message;
      Debug.LogError("mocap: " + fault.Message, this);
      enabled = false;
    }
  }

  void OnDisable() {
    running_.Remove(this);
    Frame = null;
    if (client_ != null) {
      client_.Dispose();
      Status = "the Mocap Feed is disabled";
    }
    if (buffer_ != null) buffer_.Dispose();
    client_ = null;
    buffer_ = null;
  }

  void Update() {
    if (client_ == null) return;
    if (client_.Poll(buffer_)) {
      Frame = buffer_;
      ++Count;
      lastFrame_ = Time.unscaledTime;
    }
    if (Frame != null && Time.unscaledTime - lastFrame_ > kSilence_s) {
      Frame = null;
      nextStatus_ = 0;
    }
    if (Time.unscaledTime < nextStatus_) return;
    nextStatus_ = Time.unscaledTime + (Frame != null ? 1.0f : 0.1f);  // a reason why nothing arrives is never old
    string sentence;
    client_.Diagnose(out sentence);
    Status = sentence;
  }
}

}  // namespace Mocap
