#include "bench/bridges/receivers.h"

#include <poll.h>
#include <sys/socket.h>

#include <utility>

#include "base/time.h"

namespace mocap::bench {
namespace {

constexpr Duration kAskAgain = std::chrono::milliseconds(100);
constexpr int kPatience_ms = 20;
constexpr int kBuffer_bytes = 1 << 21;  // of a receiver that has no processor for some time

class Silent : public Joining {
 public:
  void ask(const bridge::UdpSocket& /*socket*/) override {}
  void answer(const bridge::UdpSocket& /*socket*/, std::string_view /*packet*/) override {}
};

}  // namespace

std::unique_ptr<Joining> join_silently() { return std::make_unique<Silent>(); }

Result<Receivers> Receivers::open(std::size_t count) {
  Receivers receivers;
  for (std::size_t i = 0; i < count; ++i) {
    std::string fault;
    auto socket = bridge::UdpSocket::open({INADDR_LOOPBACK, 0}, fault);
    if (!socket) return Error{ErrorCode::Io, fault};
    ::setsockopt(socket->descriptor(), SOL_SOCKET, SO_RCVBUF, &kBuffer_bytes, sizeof kBuffer_bytes);
    receivers.ports_.push_back(socket->bound().port);
    receivers.all_.push_back({*std::move(socket), nullptr, std::nullopt});
  }
  return receivers;
}

void Receivers::run(const std::stop_token& stop, const std::function<std::unique_ptr<Joining>()>& joining,
                    const NumberReader& number, Arrivals& arrivals, std::atomic<std::size_t>& joined) {
  std::vector<pollfd> items;
  for (One& one : all_) {
    one.joining = joining();
    items.push_back({one.socket.descriptor(), POLLIN, 0});
  }
  Timestamp ask_at = host_now();
  while (!stop.stop_requested()) {
    ::poll(items.data(), items.size(), kPatience_ms);
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (items[i].revents != 0) read(i, number, arrivals, joined);
    }
    for (One& one : all_) one.joining->drain();
    if (host_now() < ask_at) continue;
    ask_at = host_now() + kAskAgain;
    for (One& one : all_) {
      if (!one.frame) one.joining->ask(one.socket);
    }
  }
}

void Receivers::read(std::size_t index, const NumberReader& number, Arrivals& arrivals,
                     std::atomic<std::size_t>& joined) {
  One& one = all_[index];
  one.socket.receive([&](const bridge::Peer& /*from*/, std::string_view packet) {
    const std::int64_t now_ns = to_ns(host_now());
    const auto frame = number(packet);
    if (!frame && !one.frame) return one.joining->answer(one.socket, packet);
    if (frame && !std::exchange(one.frame, frame)) ++joined;
    arrivals.note(index, *one.frame, now_ns);
  });
}

}  // namespace mocap::bench
