#include "wire/peer_greeting.h"

#include <zmq.h>

#include <algorithm>
#include <cstring>
#include <string_view>

namespace mocap::wire {
namespace {

constexpr std::size_t kSignature = 10;  // bytes: 0xff, 8 of padding, 0x7f
constexpr char kOldestMajor = 3;
// Longer than any question. With -1 (never), ZeroMQ 4.3 loses what a program sent before it closed the connection.
constexpr int kReconnect_ms = 3'600'000;

}  // namespace

void PeerGreeting::ask(void* context, const std::string& endpoint) {
  if (is_asking() || context == nullptr || endpoint.compare(0, 6, "tcp://") != 0) return;
  stream_ = zmq_socket(context, ZMQ_STREAM);
  connected_ = false;
  received_ = 0;
  const int none = 0, ipv6 = endpoint.compare(0, 7, "tcp://[") == 0 ? 1 : 0;
  const bool connecting = stream_ != nullptr && zmq_setsockopt(stream_, ZMQ_LINGER, &none, sizeof(none)) == 0 &&
                          zmq_setsockopt(stream_, ZMQ_RECONNECT_IVL, &kReconnect_ms, sizeof(kReconnect_ms)) == 0 &&
                          zmq_setsockopt(stream_, ZMQ_IPV6, &ipv6, sizeof(ipv6)) == 0 &&
                          zmq_connect(stream_, endpoint.c_str()) == 0;
  if (!connecting) close();
}

void PeerGreeting::close() {
  if (stream_ != nullptr) zmq_close(stream_);
  stream_ = nullptr;
}

// Sends signature and version. The program then sends all of its own greeting and waits for the rest of this one.
void PeerGreeting::send_greeting(const void* peer, std::size_t length) {
  constexpr unsigned char kOurs[kUntilMechanism] = {0xff, 0, 0, 0, 0, 0, 0, 0, 1, 0x7f, kOldestMajor, 0};
  if (zmq_send(stream_, peer, length, ZMQ_SNDMORE | ZMQ_DONTWAIT) < 0) return;
  zmq_send(stream_, kOurs, sizeof(kOurs), ZMQ_DONTWAIT);
}

Greeting PeerGreeting::read() {
  // ZMQ_STREAM: each message is the id of the peer, then bytes; none when the connection begins or ends.
  constexpr std::size_t kLongestId = 255;
  char id[kLongestId], bytes[256];
  while (stream_ != nullptr) {
    const int id_length = zmq_recv(stream_, id, sizeof(id), ZMQ_DONTWAIT);
    if (id_length < 0) break;
    const int length = zmq_recv(stream_, bytes, sizeof(bytes), ZMQ_DONTWAIT);
    if (length <= 0) {
      if (connected_)
        close();
      else
        send_greeting(id, static_cast<std::size_t>(id_length));
      connected_ = true;
      continue;
    }
    const std::size_t kept = std::min({static_cast<std::size_t>(length), sizeof(bytes), greeting_.size() - received_});
    std::memcpy(greeting_.data() + received_, bytes, kept);
    received_ += kept;
    const Greeting said = mechanism();
    if (said == Greeting::Unknown) continue;
    close();
    return said;
  }
  return Greeting::Unknown;
}

Greeting PeerGreeting::mechanism() const {
  const auto byte = [this](std::size_t i) { return static_cast<unsigned char>(greeting_[i]); };
  const bool other = (received_ > 0 && byte(0) != 0xff) || (received_ >= kSignature && (byte(9) & 1) == 0) ||
                     (received_ > kSignature && greeting_[kSignature] < kOldestMajor);
  if (other) return Greeting::NotZeroMq;
  if (received_ < greeting_.size()) return Greeting::Unknown;
  const std::string_view name(greeting_.data() + kUntilMechanism, kMechanism);
  return name.substr(0, name.find('\0')) == "NULL" ? Greeting::WithoutKeys : Greeting::WithKeys;
}

}  // namespace mocap::wire
