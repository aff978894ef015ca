#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdio>
#include <string>

#include "base/expects.h"
#include "cameras/own_network.h"
#include "fuzz/fuzz_arguments.h"
#include "fuzz/inputs.h"
#include "gige_device.h"

// Fuzzes the simulated GigE Vision camera with commands of a hostile client over a real socket: discovery, registers,
// memory, resends and actions with bytes changed, removed and repeated. After each 16 commands the camera must answer a
// discovery. Runs in a network namespace of its own, and is skipped (77) where the system gives none.
//
// usage: gvcp_fuzz [COUNT [SEED]]

namespace mocap::sim {
namespace {

std::string command(std::uint8_t id, const std::string& payload) {
  std::string packet{
      0x42, 0x01, static_cast<char>(id == 0 ? 1 : 0), static_cast<char>(id), 0, static_cast<char>(payload.size()),
      0,    7};
  return packet + payload;
}

std::string words(std::initializer_list<std::uint32_t> numbers) {
  std::string bytes;
  for (const std::uint32_t number : numbers) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift);
  }
  return bytes;
}

const std::string kDiscovery = command(0x02, "");

std::vector<std::string> commands() {
  return {kDiscovery,
          command(0x80, words({0x0a00})),              // the register of control
          command(0x82, words({0x0a00, 2})),           // take control
          command(0x82, words({0x0d04, 0x000005dc})),  // size of packets
          command(0x82, words({0x0d18, 0x7f000001})),  // address of the stream
          command(0x84, words({0x0000, 512})),         // read memory
          command(0x84, words({0x10000, 536})),        // the description
          command(0x80, words({0x7fffffff})),          // addresses behind the description
          command(0x84, words({0x00060000, 512})),
          command(0x82, words({0xfffffffc, 1})),
          command(0x86, words({0xfffffff8, 1, 2})),
          command(0x86, words({0x0048, 1, 2, 3, 4})),  // write memory
          command(0x40, words({1, 0, 5})),             // packet resend
          command(0x00, words({0, 0, 0, 0, 1})),       // action
          command(0x82, words({0x0124, 1}))};          // begin of acquisition
}

class Client {
 public:
  explicit Client(const char* address) : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const timeval patience{60, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(3956);
    inet_pton(AF_INET, address, &to.sin_addr);
    MOCAP_EXPECTS(::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0);
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void send(const std::string& packet) const { ::send(socket_, packet.data(), packet.size(), 0); }

  // Whether the answer to a discovery comes; answers to earlier commands come before it.
  bool finds() const {
    send(kDiscovery);
    char answer[2000];
    for (ssize_t size = 0; (size = ::recv(socket_, answer, sizeof answer, 0)) > 0;) {
      if (size == 8 + 0xf8 && answer[3] == 3) return true;
    }
    return false;
  }

 private:
  int socket_;
};

}  // namespace
}  // namespace mocap::sim

int main(int argc, char** argv) {
  using namespace mocap;       // NOLINT: the program
  using namespace mocap::sim;  // NOLINT: the program
  const fuzz::Arguments arguments(argc, argv);
  if (const std::string refusal = cameras::enter_own_network(1); !refusal.empty()) {
    std::printf("skipped: %s\n", refusal.c_str());
    return 77;
  }
  GigeDevice::Settings settings;
  settings.address = "127.0.0.2";
  settings.serial = "FUZZ";
  const auto device = GigeDevice::serve(settings);
  MOCAP_EXPECTS(device.has_value());
  const Client client("127.0.0.2");
  fuzz::Inputs inputs(fuzz::Inputs::Kind::Binary, arguments.seed, commands());
  bool alive = client.finds();
  for (std::uint64_t i = 0; alive && i < arguments.count; ++i) {
    client.send(inputs.next());
    if (i % 16 == 15) alive = client.finds();
  }
  alive = alive && client.finds();
  arguments.print("commands");
  return alive ? 0 : 1;
}
