#include "bridges/natnet/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/bridges/free_port.h"
#include "bridges/frames.h"
#include "bridges/lib/event_loop.h"
#include "bridges/lib/udp_socket.h"

namespace mocap::natnet {
namespace natnet_server_test {

using bridge::Peer;
using bridge::UdpSocket;
using bridge::testing::TestFrame;
using bridge::testing::TestSubject;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::chrono::seconds kLimit(60);  // of a failing test

std::string packet(Message message) { return {static_cast<char>(message), '\0', '\0', '\0'}; }

// A client of the server, or a receiver that never connects.
class Guest {
 public:
  Guest() {
    std::string fault;
    socket_ = UdpSocket::open({INADDR_LOOPBACK, 0}, fault);
    EXPECT_TRUE(socket_.has_value()) << fault;
  }

  void send(Message message, std::uint16_t port, std::string_view text = {}) const {
    socket_->send({INADDR_LOOPBACK, port}, packet(message).append(text));
  }
  Peer peer() const { return socket_->bound(); }
  auto is_receiver() const { return Field(&bridge::Receiver::address, to_string(peer())); }
  // How many packets of this kind came until now.
  int received(Message message) {
    socket_->receive([&](const Peer& /*from*/, std::string_view got) { kinds_.emplace_back(got.substr(0, 2)); });
    return static_cast<int>(std::count(kinds_.begin(), kinds_.end(), packet(message).substr(0, 2)));
  }

 private:
  std::optional<UdpSocket> socket_;
  std::vector<std::string> kinds_;
};

class NatNetServer : public ::testing::Test {
 protected:
  void serve(std::vector<Peer> to = {}, double forget_after_s = 3600.0) {
    ServerOptions options;
    options.forget_after_s = forget_after_s;
    options.command_port = port_;
    options.to = std::move(to);
    server_.emplace(options, statistics_);
    ASSERT_EQ(server_->open(loop_), "");
  }

  // Serves until `holds`, or the limit is over.
  bool serve_until(const std::function<bool()>& holds) {
    const auto limit = std::chrono::steady_clock::now() + kLimit;
    bool held = false;
    loop_.run(std::chrono::milliseconds(1), [&] {
      server_->tick();
      held = holds();
      if (held || std::chrono::steady_clock::now() > limit) loop_.stop();
    });
    return held;
  }

  bool connect(Guest& guest) {
    guest.send(Message::Connect, port_);
    return serve_until([&] { return guest.received(Message::ServerInfo) > 0; });
  }

  const std::uint16_t port_ = *bench::free_port();
  bridge::Statistics statistics_;
  bridge::EventLoop loop_;
  std::optional<Server> server_;
};

TEST_F(NatNetServer, AFurtherClientReplacesTheOneThatWasSilentForLongest) {
  Guest fixed;
  serve({fixed.peer()});
  std::vector<Guest> guests(Server::kMaxClients - 1);
  for (Guest& guest : guests) ASSERT_TRUE(connect(guest));
  const std::uint64_t requests = statistics_.requests;
  guests[0].send(Message::KeepAlive, port_);
  ASSERT_TRUE(serve_until([&] { return statistics_.requests > requests; }));

  Guest further;
  ASSERT_TRUE(connect(further));

  const std::vector<bridge::Receiver> receivers = server_->receivers();
  EXPECT_EQ(receivers.size(), Server::kMaxClients);
  EXPECT_THAT(receivers, Contains(further.is_receiver()));
  EXPECT_THAT(receivers, Contains(fixed.is_receiver()));
  EXPECT_THAT(receivers, Contains(guests[0].is_receiver()));
  EXPECT_THAT(receivers, Not(Contains(guests[1].is_receiver())));
}

TEST_F(NatNetServer, ClientsThatNeverConnectReplaceOnlyEachOther) {
  serve();
  std::vector<Guest> guests(Server::kMaxClients - 1);
  for (Guest& guest : guests) ASSERT_TRUE(connect(guest));
  std::vector<Guest> askers(3);

  for (const Guest& asker : askers) {
    const std::uint64_t requests = statistics_.requests;
    asker.send(Message::RequestModels, port_);
    ASSERT_TRUE(serve_until([&] { return statistics_.requests > requests; }));
  }

  for (const Guest& guest : guests) EXPECT_THAT(server_->receivers(), Contains(guest.is_receiver()));
  EXPECT_THAT(server_->receivers(), Contains(askers.back().is_receiver()));
  EXPECT_EQ(server_->receivers().size(), Server::kMaxClients);

  Guest further;
  ASSERT_TRUE(connect(further));

  for (const Guest& guest : guests) EXPECT_THAT(server_->receivers(), Contains(guest.is_receiver()));
  EXPECT_THAT(server_->receivers(), Contains(further.is_receiver()));

  const std::uint64_t requests = statistics_.requests;
  askers[0].send(Message::RequestModels, port_);
  ASSERT_TRUE(serve_until([&] { return statistics_.requests > requests; }));

  EXPECT_THAT(server_->receivers(), Not(Contains(askers[0].is_receiver())));
  EXPECT_THAT(server_->receivers(), Contains(guests[0].is_receiver()));
}

TEST_F(NatNetServer, TheLogNamesTheClientThatWasReplaced) {
  serve();
  std::vector<Guest> guests(Server::kMaxClients);
  for (Guest& guest : guests) ASSERT_TRUE(connect(guest));
  Guest further;

  ::testing::internal::CaptureStderr();
  const bool first = connect(further);
  const std::string said = ::testing::internal::GetCapturedStderr();
  ASSERT_TRUE(first);

  EXPECT_THAT(said, HasSubstr("client " + to_string(guests[0].peer()) + " gets no more frames"));
  EXPECT_THAT(said, HasSubstr(to_string(further.peer())));
}

TEST_F(NatNetServer, AFixedReceiverThatStartsLaterGetsTheDescriptions) {
  Guest fixed;
  serve({fixed.peer()});
  const TestFrame frame({TestSubject{}});
  server_->take(frame.get(), true);
  ASSERT_TRUE(serve_until([&] { return fixed.received(Message::Frame) == 1; }));
  const int before = fixed.received(Message::Models);

  EXPECT_TRUE(serve_until([&] { return fixed.received(Message::Models) >= before + 2; }));
}

TEST_F(NatNetServer, AFixedReceiverIsAnsweredAndStaysAfterItsDisconnect) {
  Guest fixed;
  serve({fixed.peer()});

  EXPECT_TRUE(connect(fixed));
  const std::uint64_t requests = statistics_.requests;
  fixed.send(Message::Disconnect, port_);
  EXPECT_TRUE(serve_until([&] { return statistics_.requests > requests; }));

  EXPECT_THAT(server_->receivers(), Contains(fixed.is_receiver()));
}

TEST_F(NatNetServer, AFixedReceiverHasTheSettingsOfTheOptionsAgainOnceItIsForgotten) {
  Guest fixed;
  serve({fixed.peer()});
  const auto settings = [&] { return server_->receivers().at(0).settings; };
  const std::string before = settings();

  for (const bool by_command : {false, true}) {
    fixed.send(Message::Request, port_, "SetProperty,,Up Axis,Z-Axis");
    fixed.send(Message::Request, port_, "Bitstream,4.1");
    ASSERT_TRUE(serve_until([&] { return settings().starts_with("4.1 z-up"); })) << settings();

    if (by_command) fixed.send(Message::Request, port_, "Disconnect");
    if (!by_command) fixed.send(Message::Disconnect, port_);

    EXPECT_TRUE(serve_until([&] { return settings() == before; })) << settings();
  }
}

TEST_F(NatNetServer, ASilentFixedReceiverHasTheSettingsOfTheOptionsAgain) {
  Guest fixed;
  serve({fixed.peer()}, /*forget_after_s=*/0.5);
  const std::string before = server_->receivers().at(0).settings;
  const TestFrame frame({TestSubject{}});

  fixed.send(Message::Request, port_, "Bitstream,4.1");
  EXPECT_TRUE(serve_until(
      [&] { return fixed.received(Message::Response) > 0 && server_->receivers().at(0).settings == before; }));

  server_->take(frame.get(), false);
  EXPECT_EQ(fixed.received(Message::Frame), 0) << "before the descriptions of its version";
  EXPECT_TRUE(serve_until([&] {
    server_->take(frame.get(), false);
    return fixed.received(Message::Frame) > 0;
  }));
}

}  // namespace natnet_server_test
}  // namespace mocap::natnet
