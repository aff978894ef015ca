#include <memory>
#include <random>
#include <string>
#include <vector>

#include "base/expects.h"
#include "fuzz/fuzz_arguments.h"
#include "model/search_health.h"
#include "trigger/desk.h"
#include "trigger/ip4.h"
#include "trigger/osc_packet.h"
#include "trigger/xml_packet.h"

// Fuzzes remote triggers: valid packets of XML, Xsens and OSC with bytes changed, removed and repeated, and random
// bytes, to each socket of a desk whose recorder answers in any order. Each packet is copied to a memory block of its
// exact size, so that the address sanitizer detects reads beyond its end. Every packet must be refused with a reason or
// have a bounded effect, and every packet that the desk sends must be readable.
//
// usage: trigger_fuzz [COUNT [SEED]]

namespace mocap::trigger {
namespace {

class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed) : random_(seed) { restart(); }

  void try_once() {
    if (below(2000) == 0) restart();
    now_ += std::chrono::milliseconds(below(200));
    const std::string packet = below(10) == 0 ? random_bytes(300) : damaged(valid_packet());
    const std::unique_ptr<char[]> exact(new char[packet.size()]);
    packet.copy(exact.get(), packet.size());
    check(read_xml({exact.get(), packet.size()}, below(2) == 0));
    check(read_osc({exact.get(), packet.size()}));
    Datagram datagram{below(sockets_.size()), {senders_[below(senders_.size())], 4000}, packet};
    datagram.cut = below(50) == 0;
    check(desk_->receive(datagram, now_));
    if (below(2) == 0) answer();
  }

  std::uint64_t orders() const { return executed_; }

 private:
  std::size_t below(std::size_t end) { return random_() % end; }

  void restart() {
    TriggerSettings settings;
    settings.listen = "0.0.0.0";
    settings.senders = {"10.0.0.7", "10.0.0.9"};
    settings.xsens_ports = {6004};
    settings.osc_ports = {8000};
    settings.xml_receivers = {"10.0.0.9:30"};
    settings.osc_receivers = {"10.0.0.9:8000"};
    sockets_ = sockets_of(settings);
    senders_ = {*read_address("10.0.0.7"), *read_address("10.0.0.9"), *read_address("10.0.0.66")};
    desk_ = make_desk(settings, 1);
    unanswered_.clear();
    take_ = {};
  }

  std::string name() {
    constexpr const char* kNames[] = {"", "walk", "run", "caf\xC3\xA9 & <b>", "take_001"};
    return kNames[below(std::size(kNames))];
  }

  std::string valid_packet() {
    const std::string id = below(4) == 0 ? "" : std::to_string(below(20));
    switch (below(7)) {
      case 0: return write_osc("/RecordStart", {name().substr(0, 3), static_cast<std::int32_t>(random_())});
      case 1: return write_osc("/RecordStop", {});
      case 2: return "<StartRecordingReq SessionName=\"C:/mvn/walk\"/>";
      case 3: return "<StopRecordingReq/>";
      case 4: return write_capture({.verb = Verb::Complete, .result = "SUCCESS", .name = name(), .packet_id = id});
      case 5: {
        const char* result = below(4) == 0 ? "CANCEL" : "SUCCESS";
        return write_capture({.verb = Verb::Stop, .result = result, .name = name(), .packet_id = id});
      }
      default: break;
    }
    return write_capture({.verb = Verb::Start,
                          .name = name(),
                          .notes = "n",
                          .delay = std::chrono::milliseconds(below(3) * 100),
                          .packet_id = id});
  }

  std::string random_bytes(std::size_t most) {
    std::string bytes(below(most), '\0');
    for (char& byte : bytes) byte = static_cast<char>(random_());
    return bytes;
  }

  std::string damaged(std::string bytes) {
    for (std::size_t times = below(4) * below(2); times > 0 && !bytes.empty(); --times) {
      const std::size_t place = below(bytes.size());
      switch (below(5)) {
        case 0: bytes[place] = static_cast<char>(random_()); break;
        case 1: bytes.resize(place); break;
        case 2: bytes.insert(place, bytes, place, below(60)); break;
        case 3: bytes.insert(place, "<!DOCTYPE a [<!ENTITY b 'c'>]>"); break;
        default: bytes.insert(place, random_bytes(20));
      }
    }
    return bytes;
  }

  static void check(const Result<Request>& read) {
    if (!read) {
      MOCAP_EXPECTS(read.error().code == ErrorCode::InvalidArgument && !read.error().message.empty());
      return;
    }
    MOCAP_EXPECTS(read->name.size() + read->notes.size() + read->packet_id.size() <= 2 * kMaxPacket_bytes);
    MOCAP_EXPECTS(read->delay >= Duration{} && read->delay <= std::chrono::minutes(10));
  }

  void check(const TriggerActions& actions) {
    for (const Datagram& packet : actions.packets) {
      MOCAP_EXPECTS(packet.socket < sockets_.size() && !packet.bytes.empty());
      MOCAP_EXPECTS(packet.peer.address != senders_.back());
    }
    for (const TriggerActions::Line& line : actions.lines) {
      for (const char c : line.text) MOCAP_EXPECTS(static_cast<unsigned char>(c) >= 0x20 && c != 0x7f);
    }
    if (!actions.order) return;
    ++executed_;
    unanswered_.push_back(*actions.order);
  }

  // The recorder answers an order, executes one, or ends its take by itself.
  void answer() {
    const bool records = take_.state == TakeState::Recording || take_.state == TakeState::Waiting;
    if (unanswered_.empty()) {
      if (records) take_.state = below(2) == 0 ? TakeState::Failed : TakeState::Ended;
      return check(desk_->hear({0, std::nullopt, take_}, now_));
    }
    const std::size_t which = below(unanswered_.size());
    const TakeOrder order = unanswered_[which];
    if (order.action != TakeAction::Start && records && below(2) == 0) {
      return check(desk_->hear({order.number, std::nullopt, take_}, now_));
    }
    unanswered_.erase(unanswered_.begin() + static_cast<std::ptrdiff_t>(which));
    const bool done = (order.action == TakeAction::Start) != records;
    if (done && !records) {
      take_.state = order.countdown > Duration{} ? TakeState::Waiting : TakeState::Recording;
      take_.name = bounded_text<255>(order.name.empty() ? "take_001" : order.name);
      take_.path = bounded_text<1023>("/takes/x.mcap");
      ++take_.takes;
    } else if (done) {
      take_.state = order.action == TakeAction::Cancel ? TakeState::Cancelled : TakeState::Ended;
    }
    const TakeDone answer{order.number, done ? TakeOutcome::Done : TakeOutcome::Failed, "why"};
    check(desk_->hear({order.number, answer, take_}, now_));
  }

  std::mt19937_64 random_;
  Timestamp now_;
  std::vector<SocketUse> sockets_;
  std::vector<std::uint32_t> senders_;
  std::unique_ptr<TriggerDesk> desk_;
  std::vector<TakeOrder> unanswered_;
  TakeHealth take_;
  std::uint64_t executed_ = 0;
};

}  // namespace
}  // namespace mocap::trigger

int main(int argc, char** argv) {
  const mocap::fuzz::Arguments arguments(argc, argv);
  mocap::trigger::Fuzz fuzz(arguments.seed);
  for (std::uint64_t i = 0; i < arguments.count; ++i) fuzz.try_once();
  arguments.print("packets");
  return arguments.count < 1000 || fuzz.orders() > 0 ? 0 : 1;
}
