#pragma once

#include <gtest/gtest.h>
#include <zmq.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "wire/zmq_socket.h"

namespace mocap::wire {

/// The first 32 bytes of a ZMTP 3.0 greeting with this mechanism of security: until byte 12, signature and version.
inline std::string zmtp_greeting(std::string_view mechanism) {
  std::string greeting("\xff\0\0\0\0\0\0\0\1\x7f\3\0", 12);
  greeting += mechanism;
  greeting.resize(32, '\0');
  return greeting;
}

/// A TCP server at a free loopback port that speaks no protocol: a function says what it sends, called for a new
/// connection with no bytes, then with all that the client has sent. Nothing: the server closes the connection.
class RawServer {
 public:
  using Answer = std::function<std::optional<std::string>(std::string_view received)>;

  explicit RawServer(Answer answer) : answer_(std::move(answer)) {
    char endpoint[64];
    std::size_t length = sizeof(endpoint);
    EXPECT_TRUE(socket_.open(context_, ZMQ_STREAM, "raw server"));
    EXPECT_EQ(zmq_bind(socket_.get(), "tcp://127.0.0.1:*"), 0);
    EXPECT_EQ(zmq_getsockopt(socket_.get(), ZMQ_LAST_ENDPOINT, endpoint, &length), 0);
    endpoint_ = endpoint;
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) serve();
    });
  }

  const std::string& endpoint() const { return endpoint_; }

 private:
  void serve() {
    zmq_pollitem_t item{socket_.get(), 0, ZMQ_POLLIN, 0};
    zmq_poll(&item, 1, 5);
    ZmqMessage peer, bytes;
    if (!peer.receive(socket_) || !bytes.receive(socket_)) return;
    const std::string id(peer.bytes());
    if (bytes.bytes().empty() && received_.erase(id) > 0) return;  // the client closed the connection
    received_[id] += bytes.bytes();
    const std::optional<std::string> said = answer_(received_[id]);
    if (said && said->empty()) return;
    // Without waiting: the client may have closed the connection, and then only reading frees its queue.
    if (zmq_send(socket_.get(), id.data(), id.size(), ZMQ_SNDMORE | ZMQ_DONTWAIT) < 0) return;
    zmq_send(socket_.get(), said.value_or("").data(), said ? said->size() : 0, ZMQ_DONTWAIT);
  }

  Answer answer_;
  ZmqContext context_;
  ZmqSocket socket_;
  std::string endpoint_;
  std::map<std::string, std::string> received_;  // by connection
  std::jthread thread_;
};

}  // namespace mocap::wire
