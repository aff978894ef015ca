// mocap-vmc: tells a subject of a feed to programs that speak the VMC protocol (OSC over UDP).
#include <fmt/core.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <string>
#include <thread>

#include "lib/cli/app.h"
#include "vmc.h"

namespace {

using namespace mocap;  // NOLINT: the program

constexpr int kUsage = 64;                      // sysexits EX_USAGE
constexpr int kUnavailable = 69;                // sysexits EX_UNAVAILABLE
constexpr std::size_t kMaxPacket_bytes = 1400;  // under an Ethernet frame's 1500, so that nothing is split

volatile std::sig_atomic_t stop_asked = 0;
void ask_stop(int /*signal*/) { stop_asked = 1; }

struct Options {
  ClientOptions feed{.axes = MOCAP_AXES_UNITY};
  std::string subject;
  std::string host = "127.0.0.1";
  std::string port = "39539";
  double rate_hz = 60.0;
  double seconds = 0.0;
};

// A UDP socket that sends to one place; -1: there is none.
int open_udp(const Options& options) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (const int fault = ::getaddrinfo(options.host.c_str(), options.port.c_str(), &hints, &found); fault != 0) {
    fmt::print(stderr, "mocap-vmc: --to {} --port {}: {}\n", options.host, options.port, ::gai_strerror(fault));
    return -1;
  }
  int udp = -1;
  for (const addrinfo* at = found; at != nullptr && udp < 0; at = at->ai_next) {
    udp = ::socket(at->ai_family, at->ai_socktype | SOCK_CLOEXEC, at->ai_protocol);
    if (udp >= 0 && ::connect(udp, at->ai_addr, at->ai_addrlen) != 0) {
      ::close(udp);
      udp = -1;
    }
  }
  ::freeaddrinfo(found);
  if (udp < 0) fmt::print(stderr, "mocap-vmc: --to {} --port {}: cannot be reached\n", options.host, options.port);
  return udp;
}

class Bridge {
 public:
  Bridge(const Options& options, const Client& client, int udp) : options_(options), client_(client), udp_(udp) {}

  void run() {
    const auto period = std::chrono::duration<double>(1.0 / options_.rate_hz);
    auto next = Clock::now();
    auto next_word = next + std::chrono::seconds(2);
    while (stop_asked == 0 && (options_.seconds <= 0.0 || seconds_since_start() < options_.seconds)) {
      if (client_.poll(frame_)) {
        send();
      } else if (Clock::now() - last_sent_ > std::chrono::seconds(1)) {
        send_silence();
      }
      if (Clock::now() >= next_word) {
        tell();
        next_word = Clock::now() + std::chrono::seconds(2);
      }
      next += std::chrono::duration_cast<Clock::duration>(period);
      if (next < Clock::now()) next = Clock::now();
      std::this_thread::sleep_until(next);
    }
  }
  unsigned long sent() const { return sent_; }

 private:
  using Clock = std::chrono::steady_clock;

  double seconds_since_start() const { return std::chrono::duration<double>(Clock::now() - started_).count(); }

  void send() {
    const auto subject = options_.subject.empty() ? frame_.subject(0) : frame_.subject(options_.subject);
    vmc::say_frame(subject ? &*subject : nullptr, static_cast<float>(seconds_since_start()), bundles_);
    send_bundles();
    ++sent_;
  }

  // That we live, and track nobody.
  void send_silence() {
    vmc::say_frame(nullptr, static_cast<float>(seconds_since_start()), bundles_);
    send_bundles();
  }

  // Nobody there is no fault of ours: UDP's refusals are for whoever listens next.
  void send_bundles() {
    last_sent_ = Clock::now();
    for (const std::string& bundle : bundles_.bundles()) ::send(udp_, bundle.data(), bundle.size(), MSG_NOSIGNAL);
  }

  // When all is well: once.
  void tell() {
    const ClientDiagnosis now = client_.diagnose();
    if (now.code == told_) return;
    told_ = now.code;
    fmt::print(stderr, "mocap-vmc: {}\n", now.sentence);
  }

  const Options& options_;
  const Client& client_;
  int udp_;
  ClientFrame frame_;
  vmc::OscBundles bundles_{kMaxPacket_bytes};
  Clock::time_point started_ = Clock::now();
  Clock::time_point last_sent_ = Clock::now();
  unsigned long sent_ = 0;
  int told_ = -1;
};

}  // namespace

int main(int argc, char** argv) {
  Options options;
  cli::App app("Tells a subject of a mocapd's feed to programs that speak VMC, in Unity's axes.", "mocap-vmc");
  app.footer(R"(examples:
  mocap-vmc                                          the first subject of the daemon here, to 127.0.0.1:39539
  mocap-vmc tcp://10.0.0.7:5570 --subject anna --to 10.0.0.9 --rate 90
exit codes: 0 something was sent, 64 wrong command line, 69 the feed gave nothing or the receiver's name is unknown)");
  app.add_option("endpoint", options.feed.endpoint, "the feed")->capture_default_str();
  app.add_option("--subject", options.subject, "its name; without: the first");
  app.add_option("--to", options.host, "host of the receiver")->capture_default_str();
  app.add_option("--port", options.port, "UDP port of the receiver")->capture_default_str();
  app.add_option("--rate", options.rate_hz, "at most so many frames a second")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "end after this time")->check(cli::PositiveNumber{});
  app.add_option("--server-key", options.feed.server_key, "the daemon's public key, or a file with it");
  app.add_option("--key", options.feed.secret_key, "our own key, a file of mocapctl keys new");
  if (const auto exit = app.parse(argc, argv)) return *exit;
  std::string fault;
  const auto client = Client::open(options.feed, &fault);
  if (!client) {
    fmt::print(stderr, "mocap-vmc: {}\n", fault);
    return kUsage;
  }
  const int udp = open_udp(options);
  if (udp < 0) return kUnavailable;
  std::signal(SIGINT, ask_stop);
  std::signal(SIGTERM, ask_stop);
  Bridge bridge(options, *client, udp);
  bridge.run();
  ::close(udp);
  if (bridge.sent() == 0) fmt::print(stderr, "mocap-vmc: {}\n", client->diagnose().sentence);
  return bridge.sent() > 0 ? 0 : kUnavailable;
}
