// How receivers of each protocol ask for frames.
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <string>
#include <utility>

#include "bench/bridges/receivers.h"
#include "bridges/lib/descriptor.h"
#include "bridges/vrpn/message.h"

namespace mocap::bench {
namespace {

using namespace std::string_view_literals;

class NatNetClient : public Joining {
 public:
  explicit NatNetClient(std::uint16_t port) : server_{INADDR_LOOPBACK, port} {}

  void ask(const bridge::UdpSocket& socket) override { socket.send(server_, "\0\0\0\0"sv); }  // CONNECT
  void answer(const bridge::UdpSocket& socket, std::string_view packet) override {
    constexpr char kServerInfo = 1;
    if (!packet.empty() && packet.front() == kServerInfo) socket.send(server_, "\4\0\0\0"sv);  // REQUEST_MODELDEF
  }

 private:
  bridge::Peer server_;
};

class VrpnClient : public Joining {
 public:
  explicit VrpnClient(std::uint16_t port) : port_(port) {}

  void ask(const bridge::UdpSocket& socket) override {
    if (!connected_) connected_ = connect(socket.bound().port);
  }
  void answer(const bridge::UdpSocket& /*socket*/, std::string_view /*packet*/) override {}
  void drain() override {
    std::array<char, 4096> descriptions;
    while (connected_ && ::recv(tcp_.number(), descriptions.data(), descriptions.size(), MSG_DONTWAIT) > 0) {
    }
  }

 private:
  bool connect(std::uint16_t udp_port) {
    tcp_ = bridge::Descriptor(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in server{};
    server.sin_family = AF_INET;
    server.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    server.sin_port = htons(port_);
    if (::connect(tcp_.number(), reinterpret_cast<const sockaddr*>(&server), sizeof server) != 0) return false;
    const std::string hello =
        vrpn::cookie() + vrpn::message({}, udp_port, vrpn::kUdpDescription, vrpn::describe_name("127.0.0.1"));
    return ::send(tcp_.number(), hello.data(), hello.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(hello.size());
  }

  std::uint16_t port_;
  bridge::Descriptor tcp_;
  bool connected_ = false;
};

}  // namespace

std::unique_ptr<Joining> join_natnet(std::uint16_t port) { return std::make_unique<NatNetClient>(port); }
std::unique_ptr<Joining> join_vrpn(std::uint16_t port) { return std::make_unique<VrpnClient>(port); }

}  // namespace mocap::bench
