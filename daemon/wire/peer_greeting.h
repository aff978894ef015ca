#pragma once

#include <array>
#include <cstddef>
#include <string>

namespace mocap::wire {

/// The announcement of a program at the start of a connection.
enum class Greeting {
  Unknown,      ///< it has not said enough yet, closed the connection, or is not reached by TCP
  NotZeroMq,    ///< it speaks another protocol, or ZeroMQ before version 4
  WithoutKeys,  ///< ZeroMQ without encryption
  WithKeys,     ///< ZeroMQ with CURVE keys, or another mechanism of security
};

/// Asks a program which security it uses: opens one more connection, sends the beginning of a greeting (RFC 37/ZMTP)
/// and reads the program's own, which names its mechanism. A handshake that failed does not always say this: what
/// ZeroMQ reports depends on the side that closes the connection first. One thread owns the object. Needs ZeroMQ alone.
class PeerGreeting {
 public:
  PeerGreeting() = default;
  PeerGreeting(const PeerGreeting&) = delete;
  PeerGreeting& operator=(const PeerGreeting&) = delete;
  ~PeerGreeting() { close(); }

  /// Connects to an endpoint such as tcp://10.0.0.7:5570; does nothing while an earlier question is open.
  void ask(void* context, const std::string& endpoint);
  bool is_asking() const { return stream_ != nullptr; }
  /// Processes what has arrived since the last call; never waits. Ends the question when the answer is known.
  Greeting read();
  /// Ends an open question.
  void close();

 private:
  void send_greeting(const void* peer, std::size_t length);
  Greeting mechanism() const;

  static constexpr std::size_t kUntilMechanism = 12;  // bytes: signature (10), major and minor version
  static constexpr std::size_t kMechanism = 20;       // bytes: its name, padded with zeros

  void* stream_ = nullptr;
  bool connected_ = false;
  std::size_t received_ = 0;  // bytes of greeting_
  std::array<char, kUntilMechanism + kMechanism> greeting_{};
};

}  // namespace mocap::wire
