// Requests to a server that answers late.
#include "wire/request_socket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.h>

#include <thread>
#include <utility>
#include <vector>

namespace mocap::wire {
namespace request_socket_test {

constexpr Duration kLong = std::chrono::seconds(60);  // limit of a failing test

// A server that withholds its answer to each request until the next request arrives; then it answers both.
class LateServer {
 public:
  LateServer() {
    zmq_bind(socket_, "tcp://127.0.0.1:*");
    char at[256];
    std::size_t size = sizeof at;
    zmq_getsockopt(socket_, ZMQ_LAST_ENDPOINT, at, &size);
    endpoint = at;
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  LateServer(const LateServer&) = delete;
  LateServer& operator=(const LateServer&) = delete;
  ~LateServer() {
    thread_.request_stop();
    thread_.join();
    const int none = 0;
    zmq_setsockopt(socket_, ZMQ_LINGER, &none, sizeof none);
    zmq_close(socket_);
    zmq_ctx_term(context_);
  }

  std::string endpoint;

 private:
  static std::string receive(void* socket) {
    char part[64];
    const int size = zmq_recv(socket, part, sizeof part, 0);
    return {part, static_cast<std::size_t>(std::max(size, 0))};
  }

  void run(const std::stop_token& stop) {
    std::vector<std::pair<std::string, std::string>> waiting;  // sender and request
    while (!stop.stop_requested()) {
      zmq_pollitem_t item{socket_, 0, ZMQ_POLLIN, 0};
      if (zmq_poll(&item, 1, 10) <= 0) continue;
      std::string sender = receive(socket_);
      waiting.emplace_back(std::move(sender), receive(socket_));
      if (waiting.size() < 2) continue;
      for (const auto& [to, request] : waiting) {
        zmq_send(socket_, to.data(), to.size(), ZMQ_SNDMORE);
        zmq_send(socket_, request.data(), request.size(), 0);
      }
      waiting.clear();
    }
  }

  void* context_ = zmq_ctx_new();
  void* socket_ = zmq_socket(context_, ZMQ_ROUTER);
  std::jthread thread_;
};

TEST(RequestSocket, DiscardsAnAnswerThatArrivesAfterItsRequestEnded) {
  const LateServer server;
  std::string fault;
  const auto socket = RequestSocket::open({.endpoint = server.endpoint}, fault);
  ASSERT_NE(socket, nullptr) << fault;

  Reply first;
  do {  // the first request of all is answered together with the second
    first = socket->ask("first", std::chrono::milliseconds(500));
  } while (!first.connected);
  EXPECT_FALSE(first.bytes);
  EXPECT_THAT(first.why, ::testing::HasSubstr("the daemon is busy"));

  EXPECT_EQ(socket->ask("second", kLong).bytes, "second");
}

TEST(RequestSocket, NamesAMalformedEndpoint) {
  std::string fault;
  EXPECT_EQ(RequestSocket::open({.endpoint = "nonsense"}, fault), nullptr);
  EXPECT_THAT(fault, ::testing::HasSubstr("endpoint 'nonsense': expected tcp://ADDRESS:PORT or ipc://PATH"));
}

}  // namespace request_socket_test
}  // namespace mocap::wire
