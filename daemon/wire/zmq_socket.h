#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/result.h"

namespace mocap::wire {

/// What ZeroMQ's last failed call in this thread says, after "WHAT: ".
Error zmq_failure(const std::string& what);

/// Outlives its sockets.
class ZmqContext {
 public:
  ZmqContext();
  ~ZmqContext();
  ZmqContext(const ZmqContext&) = delete;
  ZmqContext& operator=(const ZmqContext&) = delete;

  void* get() const { return context_; }

 private:
  void* context_;
};

/// One ZeroMQ socket; closes itself. One thread uses it at a time.
class ZmqSocket {
 public:
  ZmqSocket() = default;
  ~ZmqSocket();
  ZmqSocket(const ZmqSocket&) = delete;
  ZmqSocket& operator=(const ZmqSocket&) = delete;

  /// `kind`: ZMQ_PUB and so on.
  Status open(const ZmqContext& context, int kind, const std::string& who);
  void close();

  Status set(int option, int value);
  Status set(int option, std::string_view bytes);
  Status set_wide(int option, std::int64_t value);

  /// Takes note of what ZeroMQ's own thread did, such as which messages it took away. By itself it does so after about
  /// a millisecond of sending, or after 100 parts received; till then messages that are long gone count as waiting.
  void catch_up() const;

  /// Where it is bound last, with the true port; empty when nowhere.
  std::string last_endpoint() const;
  void* get() const { return socket_; }
  const std::string& who() const { return who_; }

 private:
  void* socket_ = nullptr;
  std::string who_;  // as errors call it
};

/// One message part; closes itself. Receives into the same memory again and again.
class ZmqMessage {
 public:
  ZmqMessage();
  ~ZmqMessage();
  ZmqMessage(const ZmqMessage&) = delete;
  ZmqMessage& operator=(const ZmqMessage&) = delete;

  /// Takes the next part if one is there now.
  bool receive(const ZmqSocket& from);
  bool has_more() const;
  std::string_view bytes() const;
  /// The file descriptor of the connection that it came by; -1 where nobody knows.
  int connection() const;
  /// What ZAP said that its sender is; empty without CURVE.
  std::string_view user() const;

 private:
  static constexpr std::size_t kSize = 64;  // of a zmq_msg_t; checked where that is known
  alignas(void*) unsigned char raw_[kSize];
};

}  // namespace mocap::wire
