#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/result.h"
#include "base/time.h"
#include "wire/zmq_context.h"

namespace mocap::wire {

/// Longest wait for a message before a stop request is looked for.
inline constexpr Duration kLongestWait = std::chrono::milliseconds(50);

/// A time as zmq_poll takes it, rounded up; 0 for a time that is over, because zmq_poll waits without end for a
/// negative one.
inline long whole_ms(Duration span) {
  return std::max<long>(0, std::chrono::ceil<std::chrono::milliseconds>(span).count());
}

/// Returns the error of the last failed ZeroMQ call of this thread; its message starts with "WHAT: ".
Error zmq_failure(const std::string& what);

/// A ZeroMQ socket; the destructor closes it. One thread at a time uses it.
class ZmqSocket {
 public:
  ZmqSocket() = default;
  ~ZmqSocket();
  ZmqSocket(const ZmqSocket&) = delete;
  ZmqSocket& operator=(const ZmqSocket&) = delete;

  /// `kind` is ZMQ_PUB or another socket type; `who` starts the message of each error.
  Status open(const ZmqContext& context, int kind, const std::string& who);
  void close();

  Status set(int option, int value);
  Status set(int option, std::string_view bytes);
  Status set_wide(int option, std::int64_t value);

  /// Processes pending commands of ZeroMQ's own thread, such as "messages were sent". Without this call ZeroMQ does so
  /// only about every millisecond of sending or every 100 received parts, and counts messages already sent as queued.
  void catch_up() const;

  /// The endpoint of the last bind, with the port number in use; empty if not bound.
  std::string last_endpoint() const;
  void* get() const { return socket_; }
  const std::string& who() const { return who_; }

 private:
  void* socket_ = nullptr;
  std::string who_;
};

/// One message part. Reusable: each `receive` replaces the content.
class ZmqMessage {
 public:
  ZmqMessage();
  ~ZmqMessage();
  ZmqMessage(const ZmqMessage&) = delete;
  ZmqMessage& operator=(const ZmqMessage&) = delete;

  /// Receives the next part; returns false at once if none waits.
  bool receive(const ZmqSocket& from);
  bool has_more() const;
  std::string_view bytes() const;
  /// The file descriptor of the connection that delivered the message; -1 if unknown.
  int connection() const;
  /// The sender's user id from authentication (ZAP): its public key. Empty without CURVE.
  std::string_view user() const;

 private:
  static constexpr std::size_t kSize = 64;  // sizeof(zmq_msg_t), checked in zmq_socket.cpp
  alignas(void*) unsigned char raw_[kSize];
};

}  // namespace mocap::wire
