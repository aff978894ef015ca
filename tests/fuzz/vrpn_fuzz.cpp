#include <memory>
#include <random>
#include <string>

#include "base/expects.h"
#include "bridges/frames.h"
#include "bridges/vrpn/session.h"
#include "fuzz/fuzz_arguments.h"

// Fuzzes the server of VRPN with the bytes of hostile clients: valid messages with bytes changed, removed, repeated and
// joined, random bytes, in pieces of random sizes; and its requests by UDP. Each piece is copied to a memory block of
// its exact size, so that the address sanitizer detects reads beyond its end. What the session keeps and sends must be
// bounded.
//
// usage: vrpn_fuzz [COUNT [SEED]]

namespace mocap::vrpn {
namespace {

using bridge::testing::TestFrame;

constexpr std::int64_t kNow_ns = 1'700'000'000'000'000'000;

std::size_t below(std::mt19937_64& random, std::size_t end) { return end == 0 ? 0 : random() % end; }

std::string valid_message(std::mt19937_64& random) {
  const auto number = static_cast<std::int32_t>(below(random, 5000));
  switch (below(random, 7)) {
    case 0: return message({}, number, kSenderDescription, describe_name("actor"));
    case 1: return message({}, number, kSenderDescription, describe_name("n" + std::to_string(number)));
    case 2: return message({}, 7, kTypeDescription, describe_name(kPing));
    case 3: return message({}, number, 7, "");
    case 4: return message({}, number, kUdpDescription, std::string("127.0.0.1\0", 10));
    case 5: return message({}, number, kTypeDescription, describe_name(std::string(below(random, 200), 'n')));
    default: return message({}, number, number, std::string(below(random, 300), 'p'));
  }
}

std::string damaged(std::string bytes, std::mt19937_64& random) {
  for (std::size_t times = below(random, 3); times > 0 && !bytes.empty(); --times) {
    const std::size_t place = below(random, bytes.size());
    switch (below(random, 4)) {
      case 0: bytes[place] = static_cast<char>(random()); break;
      case 1: bytes.resize(place); break;
      case 2: bytes.insert(place, bytes, place, below(random, 40)); break;
      default: bytes[place] = static_cast<char>(static_cast<unsigned char>(bytes[place]) ^ (1U << below(random, 8)));
    }
  }
  return bytes;
}

// The stream of one client.
std::string stream(std::mt19937_64& random) {
  std::string bytes = below(random, 20) == 0 ? damaged(cookie(), random) : cookie();
  const bool hostile = below(random, 2) == 0;
  for (std::size_t count = below(random, 30); count > 0; --count) {
    const std::string next = valid_message(random);
    bytes += hostile ? damaged(next, random) : next;
  }
  return bytes;
}

// Returns whether the session remained open to the end.
bool serve(const Senders& senders, const std::vector<Report>& reports, std::mt19937_64& random) {
  Session session(senders);
  const std::string bytes = stream(random);
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = std::min(1 + below(random, 200), bytes.size() - at);
    const std::unique_ptr<char[]> exact(new char[size]);
    bytes.copy(exact.get(), size, at);
    at += size;
    if (!session.take({exact.get(), size}, kNow_ns)) {
      MOCAP_EXPECTS(!session.fault().empty());
      return false;
    }
    session.send(reports);
    session.send_text(Severity::Warning, "gone", kNow_ns);
    for (const std::string& datagram : session.datagrams()) MOCAP_EXPECTS(datagram.size() <= kMaxDatagram_bytes);
    session.datagrams().clear();
    MOCAP_EXPECTS(session.output().size() < Session::kMaxPending_bytes + 65536);
  }
  return true;
}

void request(std::mt19937_64& random) {
  const std::string bytes = damaged("192.168.0.7 " + std::to_string(below(random, 70000)), random);
  const std::unique_ptr<char[]> exact(new char[bytes.size()]);
  bytes.copy(exact.get(), bytes.size());
  const auto port = callback_port({exact.get(), bytes.size()});
  MOCAP_EXPECTS(!port || *port != 0);
}

}  // namespace
}  // namespace mocap::vrpn

int main(int argc, char** argv) {
  using namespace mocap::vrpn;  // NOLINT: the program
  const mocap::fuzz::Arguments arguments(argc, argv);
  std::mt19937_64 random(arguments.seed);
  const TestFrame frame({{.name = "actor", .bones = {{"Hips", "Hips", -1}}, .poses = {{0, 0, 1, 0, 0, 0, 1}}}});
  Senders senders;
  senders.add(frame.get());
  const auto reports = senders.report(frame.get(), mocap::client::Axes(MOCAP_AXES_MOCAP), kNow_ns);
  std::uint64_t open = 0;
  for (std::uint64_t tries = 0; tries < arguments.count; ++tries) {
    if (serve(senders, reports, random)) ++open;
    request(random);
  }
  arguments.print("clients");
  return open > 0 && open < arguments.count ? 0 : 1;
}
