// mocap_client.hpp: C++ wrapper of the C library (mocap_client.h). Header only, C++20, throws no exceptions.
//
//   std::string fault;
//   auto client = mocap::Client::open({.endpoint = "tcp://127.0.0.1:5570", .axes = MOCAP_AXES_UNREAL}, &fault);
//   mocap::ClientFrame frame;
//   if (client && client->poll(frame)) {
//     for (const mocap::ClientSubject& subject : frame.subjects()) use(subject.bones(), subject.bone_poses());
//   }
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mocap_client.h"

namespace mocap {

/// See mocap_client_options. Empty keys: no encryption.
struct ClientOptions {
  std::string endpoint = "tcp://127.0.0.1:5570";
  std::string topic = "snapshot";
  int axes = MOCAP_AXES_MOCAP;
  int keep = 1;
  std::string server_key = {};  // the initialiser avoids a warning if the member is omitted
  std::string public_key = {};
  std::string secret_key = {};
  void (*on_message)(void* argument) = nullptr;  ///< see mocap_client_options
  void* on_message_argument = nullptr;
};

/// One subject of a frame. Valid until the frame is polled again or destroyed.
class ClientSubject {
 public:
  explicit ClientSubject(const mocap_subject& raw) : raw_(raw) {}

  std::string_view name() const { return raw_.name; }
  int phase() const { return raw_.phase; }
  bool tracked() const { return raw_.phase == MOCAP_PHASE_TRACKING; }
  std::span<const mocap_bone> bones() const { return {raw_.bones, raw_.bone_count}; }
  std::span<const mocap_bone_pose> bone_poses() const { return {raw_.bone_poses, raw_.bone_pose_count}; }
  std::span<const mocap_marker> markers() const { return {raw_.markers, raw_.marker_count}; }
  std::span<const mocap_marker_pose> marker_poses() const { return {raw_.marker_poses, raw_.marker_pose_count}; }
  const mocap_subject& raw() const { return raw_; }

 private:
  mocap_subject raw_;
};

/// Owns one frame. Repeated polls reuse its memory.
class ClientFrame {
 public:
  ClientFrame() : raw_(mocap_frame_new()) {}

  mocap_frame_info info() const {
    mocap_frame_info into;
    mocap_frame_get_info(raw_.get(), &into, sizeof into);
    return into;
  }
  /// Time from the exposure to now, ns; empty if unknown.
  std::optional<std::int64_t> age_ns() const {
    const std::int64_t age = mocap_frame_age_ns(raw_.get());
    return age == MOCAP_ABSENT ? std::nullopt : std::optional(age);
  }
  std::string_view session() const { return mocap_frame_session(raw_.get()); }

  std::optional<ClientSubject> subject(std::size_t index) const {
    mocap_subject raw;
    if (mocap_frame_get_subject(raw_.get(), index, &raw, sizeof raw) == 0) return std::nullopt;
    return ClientSubject(raw);
  }
  std::optional<ClientSubject> subject(const std::string& name) const {
    const std::int32_t index = mocap_frame_find_subject(raw_.get(), name.c_str());
    return index < 0 ? std::nullopt : subject(static_cast<std::size_t>(index));
  }
  std::vector<ClientSubject> subjects() const {
    std::vector<ClientSubject> all;
    for (std::size_t i = 0; auto one = subject(i); ++i) all.push_back(*one);
    return all;
  }
  std::span<const mocap_point> points() const {
    std::size_t count = 0;
    const mocap_point* first = mocap_frame_points(raw_.get(), &count);
    return {first, count};
  }
  mocap_frame* raw() const { return raw_.get(); }

 private:
  struct Free {
    void operator()(mocap_frame* frame) const { mocap_frame_free(frame); }
  };
  std::unique_ptr<mocap_frame, Free> raw_;
};

struct ClientDiagnosis {
  int code = MOCAP_CONNECTING;  ///< enum mocap_diagnosis
  std::string sentence;
};

/// A feed. Each method may be called from any thread.
class Client {
 public:
  /// Starts to connect. Empty if an option is invalid, with the reason in `fault` if given.
  static std::optional<Client> open(const ClientOptions& options = {}, std::string* fault = nullptr) {
    mocap_client_options raw;
    mocap_client_options_init(&raw, sizeof raw);
    raw.endpoint = options.endpoint.c_str();
    raw.topic = options.topic.c_str();
    raw.axes = options.axes;
    raw.keep = options.keep;
    raw.server_key = options.server_key.c_str();
    raw.public_key = options.public_key.c_str();
    raw.secret_key = options.secret_key.c_str();
    raw.on_message = options.on_message;
    raw.on_message_argument = options.on_message_argument;
    char why[256] = {};
    mocap_client* opened = mocap_client_open(&raw, why, sizeof why);
    if (opened == nullptr) {
      if (fault != nullptr) *fault = why;
      return std::nullopt;
    }
    return Client(opened);
  }

  /// Returns true if `frame` was replaced by a newer frame. Never waits.
  bool poll(ClientFrame& frame) const { return mocap_client_poll(raw_.get(), frame.raw()) == 1; }
  bool wait(ClientFrame& frame, int timeout_ms) const {
    return mocap_client_wait(raw_.get(), frame.raw(), timeout_ms) == 1;
  }
  mocap_statistics statistics() const {
    mocap_statistics into{};
    mocap_client_get_statistics(raw_.get(), &into, sizeof into);
    return into;
  }
  ClientDiagnosis diagnose() const {
    char sentence[512] = {};
    const int code = mocap_client_diagnose(raw_.get(), sentence, sizeof sentence);
    return {code, sentence};
  }

 private:
  explicit Client(mocap_client* raw) : raw_(raw) {}
  struct Close {
    void operator()(mocap_client* client) const { mocap_client_close(client); }
  };
  std::unique_ptr<mocap_client, Close> raw_;
};

}  // namespace mocap
