#include "trigger/desk.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "model/search_health.h"
#include "trigger/answers.h"
#include "trigger/ip4.h"
#include "trigger/osc_packet.h"
#include "trigger/receivers.h"
#include "trigger/repeat_memory.h"
#include "trigger/unlisted_senders.h"
#include "trigger/xml_packet.h"

namespace mocap::trigger {
namespace {

constexpr std::size_t kMaxPending = 64;   // orders without an answer
constexpr std::size_t kMaxStoppers = 16;  // requests that wait for the end of one take
constexpr std::size_t kLongestLine = 300;

// Text of other programs, safe for a log of lines.
std::string printable(std::string text) {
  if (text.size() > kLongestLine) text = text.substr(0, kLongestLine) + "...";
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, ' ');
  return text;
}

const char* result_of(TakeState state) {
  if (state == TakeState::Failed) return "FAIL";
  return state == TakeState::Cancelled ? "CANCEL" : "SUCCESS";
}

std::string notes_of(const Request& request) {
  if (request.notes.empty() || request.description.empty()) return request.notes + request.description;
  return request.notes + "\n" + request.description;
}

// A request, and where its answers go.
struct Caller {
  std::uint64_t memory = 0;  // id of its entry
  std::size_t socket = 0;
  Peer peer;
  Request request;
};

// A take in progress.
struct Take {
  std::string name;  // empty: not known before its start
  std::string path;
  bool waiting = false;
  bool start_sent = false, stop_sent = false;  // to receivers
  bool stopping = false;
  std::optional<Caller> starter = {};
  std::vector<Caller> stoppers = {};
};

// The take before.
struct Ended {
  std::string name, path;
  const char* result = "";
};

class Desk final : public TriggerDesk {
 public:
  Desk(const TriggerSettings& settings, std::uint64_t first_packet_id)
      : settings_(settings),
        sockets_(sockets_of(settings)),
        receivers_(settings, sockets_.size() - 1, first_packet_id) {
    for (const std::string& sender : settings_.senders) senders_.insert(*read_address(sender));
  }

  TriggerActions receive(const Datagram& datagram, Timestamp now) override {
    actions_ = {};
    MOCAP_EXPECTS(datagram.socket < sockets_.size());
    const Protocol protocol = sockets_[datagram.socket].protocol;
    if (protocol == Protocol::Answers) {
      receive_answer(datagram, now);
    } else if (!senders_.contains(datagram.peer.address)) {
      refuse_unlisted(datagram.peer.address, now);
    } else {
      receive_request(datagram, protocol, now);
    }
    return std::exchange(actions_, {});
  }

  TriggerActions hear(const TakeNews& news, Timestamp) override {
    actions_ = {};
    if (news.order != 0) hear_of_order(news);
    if (news.take) observe(*news.take);
    return std::exchange(actions_, {});
  }

 private:
  // --- packets that arrive ---

  void line(bool refused, std::string text) { actions_.lines.push_back({refused, printable(std::move(text))}); }

  void refuse_unlisted(std::uint32_t address, Timestamp now) {
    if (auto text = unlisted_senders_.note(address, now)) line(true, *std::move(text));
  }

  static Result<Request> read(const Datagram& datagram, Protocol protocol) {
    if (datagram.cut) {
      return refusal(fmt::format("has over {} bytes", kMaxPacket_bytes));
    }
    return protocol == Protocol::Osc ? read_osc(datagram.bytes) : read_xml(datagram.bytes, protocol == Protocol::Xsens);
  }

  void receive_request(const Datagram& datagram, Protocol protocol, Timestamp now) {
    const std::string from = address_text(datagram.peer.address);
    const Result<Request> request = read(datagram, protocol);
    if (!request) return line(true, fmt::format("refused a packet from {}: {}", from, request.error().message));
    if (receivers_.is_own(*request)) return confirm(*request, from);
    if (request->verb == Verb::Complete) {
      return line(false, fmt::format("{} has written its file of '{}', {}", from, request->name, request->result));
    }
    if (RepeatMemory::Entry* known = repeat_of(*request, datagram.peer.address, now)) {
      for (const std::string& answer : known->answers) send_answer(datagram.socket, datagram.peer, answer);
      return line(false, fmt::format("{} {}from {} is a repeat, answered again", name_of(request->verb),
                                     request->packet_id.empty() ? "" : request->packet_id + " ", from));
    }
    Caller caller{memory_.add(datagram.peer.address, *request, now), datagram.socket, datagram.peer, *request};
    request->verb == Verb::Start ? ask_start(caller) : ask_stop(caller);
  }

  // The earlier request that this request repeats; null: none. A request without a PacketID is a repeat only while the
  // order of the earlier request is pending or the take is in the state that this order caused.
  RepeatMemory::Entry* repeat_of(const Request& request, std::uint32_t address, Timestamp now) {
    RepeatMemory::Entry* known = memory_.find(address, request, now);
    if (known == nullptr || !request.packet_id.empty()) return known;
    if (ends_pending_start(request)) return nullptr;
    const auto is_it = [&](const Caller& caller) { return caller.memory == known->id; };
    const bool pending = std::ranges::any_of(pending_, [&](const auto& each) { return is_it(each.second); });
    if (pending) return known;
    if (request.verb == Verb::Start) return take_ && take_->starter && is_it(*take_->starter) ? known : nullptr;
    return !take_ || std::ranges::any_of(take_->stoppers, is_it) ? known : nullptr;
  }

  // Whether the newest order is a start without an answer, which this stop or cancel is about.
  bool ends_pending_start(const Request& request) const {
    if (request.verb == Verb::Start || pending_.empty()) return false;
    const Request& newest = pending_.rbegin()->second.request;
    return newest.verb == Verb::Start && (request.name.empty() || request.name == newest.name);
  }

  // The answer of a receiver, or our own packet that came back.
  void confirm(const Request& request, const std::string& from) {
    if (request.result == "FAIL") {
      return line(true, fmt::format("{} answers that it does not record '{}' {}", from, request.name, request.notes));
    }
    line(false, fmt::format("{} confirms {} of '{}'", from, name_of(request.verb), request.name));
  }

  void receive_answer(const Datagram& datagram, Timestamp now) {
    const std::string from = address_text(datagram.peer.address);
    if (const Result<Request> request = read(datagram, Protocol::Xml); request && receivers_.is_own(*request)) {
      return confirm(*request, from);
    }
    if (!receivers_.contains(datagram.peer.address)) return refuse_unlisted(datagram.peer.address, now);
    line(false, fmt::format("{} answers: {}", from, datagram.bytes));
  }

  // --- requests ---

  void ask_start(const Caller& caller) {
    const Request& request = caller.request;
    // Another program passes our own start on, or a second controller starts the same take.
    const bool is_it = take_ && !take_->stopping && !request.name.empty() && request.name == take_->name;
    if (is_it) return answer_start(caller);
    TakeOrder order{.action = TakeAction::Start, .name = request.name};
    order.slate = request.slate;
    order.text = notes_of(request);
    order.countdown = request.delay;
    ask(order, caller);
  }

  void ask_stop(const Caller& caller) {
    const Request& request = caller.request;
    if (ends_pending_start(request)) return order_stop(caller);
    const bool other = !request.name.empty() && (!take_ || (!take_->name.empty() && request.name != take_->name));
    if (other && request.name == ended_.name) {
      answer_stop(caller, ended_.result, ended_.name, ended_.path);
      return complete(caller, ended_.result, ended_.name, ended_.path);
    }
    if (other && take_) {
      return refuse(caller, fmt::format("'{}' is not the take in progress, '{}'", request.name, take_->name));
    }
    if (take_ && take_->stopping && request.verb == Verb::Stop && take_->stoppers.size() < kMaxStoppers) {
      answer_stop(caller, "SUCCESS", take_->name, take_->path);
      take_->stoppers.push_back(caller);
      return;
    }
    order_stop(caller);
  }

  void order_stop(const Caller& caller) {
    TakeOrder order{.action = caller.request.verb == Verb::Cancel ? TakeAction::Cancel : TakeAction::Stop,
                    .name = caller.request.name};
    ask(order, caller);
  }

  void ask(TakeOrder& order, const Caller& caller) {
    if (pending_.size() >= kMaxPending) return refuse(caller, "the recorder does not answer");
    order.number = ++orders_;
    pending_.emplace(order.number, caller);
    actions_.order = order;
  }

  // --- news of the recorder ---

  void hear_of_order(const TakeNews& news) {
    const auto found = pending_.find(news.order);
    if (found == pending_.end()) return;
    const Caller caller = found->second;
    MOCAP_EXPECTS(news.done.has_value() || news.take.has_value());
    if (!news.done && caller.request.verb == Verb::Start) return;  // begins when the take in progress has ended
    if (!news.done) return hear_of_stop(caller, *news.take);
    pending_.erase(found);
    const bool waits =
        take_ && std::ranges::find(take_->stoppers, caller.memory, &Caller::memory) != take_->stoppers.end();
    if (waits) return;  // answered already; `observe` sees how the take ended
    if (news.done->outcome != TakeOutcome::Done) return refuse(caller, news.done->message);
    MOCAP_EXPECTS(news.take.has_value());
    if (caller.request.verb == Verb::Start) return hear_of_start(caller, *news.take);
    const std::string name(text_of(news.take->name)), &wanted = caller.request.name;
    if (!wanted.empty() && wanted != name) return answer_stop(caller, "CANCEL", wanted, {});  // it did not start
    answer_stop(caller, result_of(news.take->state), name, std::string(text_of(news.take->path)));
    if (take_) take_->stoppers.push_back(caller);
  }

  void hear_of_start(const Caller& caller, const TakeHealth& take) {
    if (take_) finish_take(TakeState::None);
    take_ = Take{.name = std::string(text_of(take.name)), .path = std::string(text_of(take.path))};
    take_->waiting = take.state == TakeState::Waiting;
    take_->starter = caller;
    answer_start(caller);
  }

  // The recorder ends the take; the file is not complete yet.
  void hear_of_stop(const Caller& caller, const TakeHealth& take) {
    follow(take);
    if (!take_) return;
    take_->stopping = true;
    answer_stop(caller, "SUCCESS", take_->name, take_->path);
    if (take_->stoppers.size() < kMaxStoppers) take_->stoppers.push_back(caller);
    notify_stop("SUCCESS");
  }

  void observe(const TakeHealth& take) {
    const bool in_progress = take.state == TakeState::Waiting || take.state == TakeState::Recording;
    if (in_progress) return follow(take);
    if (take_) finish_take(take.state);
  }

  void follow(const TakeHealth& take) {
    const std::string name(text_of(take.name));
    if (take_ && !take_->waiting && take_->name != name) finish_take(TakeState::Ended);
    if (!take_) take_ = Take{};
    take_->name = name;
    take_->path = std::string(text_of(take.path));
    take_->waiting = take.state == TakeState::Waiting;
    if (!take_->waiting) notify_start();
  }

  // `state`: None if it is not known whether the file is complete.
  void finish_take(TakeState state) {
    const Take take = *std::exchange(take_, std::nullopt);
    const char* result = result_of(state);
    ended_ = {take.name, take.path, result};
    const bool answers_starter = take.starter && !addresses(take.stoppers).contains(take.starter->peer.address);
    if (take.waiting) {  // its start was promised
      if (answers_starter) answer_stop(*take.starter, result, take.name, {});
      return;
    }
    notify_end(take, result, state != TakeState::None);
    if (state == TakeState::None) return;
    if (answers_starter) complete(*take.starter, result, take.name, take.path);
    for (const Caller& caller : take.stoppers) complete(caller, result, take.name, take.path);
  }

  // --- answers ---

  void send_answer(std::size_t socket, Peer to, const std::string& bytes) {
    const bool osc = sockets_[socket].protocol == Protocol::Osc;
    const int port = osc ? settings_.osc_answer_port : settings_.xml_answer_port;
    if (port != 0) to.port = static_cast<std::uint16_t>(port);
    actions_.packets.push_back({socket, to, bytes});
  }

  // Sends an answer, and again for each repeat of the request.
  void answer(const Caller& caller, std::optional<std::string> bytes) {
    if (!bytes) return;
    send_answer(caller.socket, caller.peer, *bytes);
    if (RepeatMemory::Entry* entry = memory_.find(caller.memory)) entry->answers.push_back(*std::move(bytes));
  }

  std::string asked(const Caller& caller) const {
    return fmt::format("{} from {}", name_of(caller.request.verb), address_text(caller.peer.address));
  }

  void answer_start(const Caller& caller) {
    const Request& request = caller.request;
    line(false, fmt::format("{}: take '{}'{}", asked(caller), take_->name,
                            take_->waiting ? fmt::format(" in {:.3f} s", to_s(request.delay)) : ""));
    answer(caller, start_answer(request, {take_->name, take_->path}));
  }

  void answer_stop(const Caller& caller, const char* result, const std::string& name, const std::string& path) {
    line(false, fmt::format("{}: take '{}', {}", asked(caller), name, result));
    answer(caller, stop_answer(caller.request, result, {name, path}));
  }

  // The file is closed and on the disk.
  void complete(const Caller& caller, const char* result, const std::string& name, const std::string& path) {
    answer(caller, complete_answer(caller.request, result, {name, path}));
    line(false, fmt::format("take '{}' for {}: complete, {}", name, address_text(caller.peer.address), result));
  }

  void refuse(const Caller& caller, const std::string& why) {
    const Request& request = caller.request;
    line(true, fmt::format("refused {}: {}", asked(caller), why));
    answer(caller, refusal_answer(request, why));
    // The start may arrive after its stop: then a repeat of the stop is executed. A repeat of a start is not, because
    // its sender knows that no take is recorded.
    const bool start = request.verb == Verb::Start;
    if (start ? request.packet_id.empty() : !request.name.empty() || request.packet_id.empty()) {
      memory_.forget(caller.memory);
    }
  }

  // --- our own packets ---

  void notify(const CapturePacket& packet, const std::set<std::uint32_t>& but) {
    const std::size_t notified = receivers_.notify(packet, but, actions_.packets);
    if (notified == 0) return;
    line(false,
         fmt::format("sent {} of '{}' {} to {} receivers", name_of(packet.verb), packet.name, packet.result, notified));
  }

  static CapturePacket packet_of(const Take& take, Verb verb, const char* result) {
    return {.verb = verb, .result = result, .name = take.name, .database_path = folder_of(take.path)};
  }

  // The addresses of these callers. A receiver that ordered a start or stop gets no packet about it: two programs that
  // notify each other would loop.
  static std::set<std::uint32_t> addresses(const std::vector<Caller>& callers) {
    std::set<std::uint32_t> all;
    for (const Caller& caller : callers) all.insert(caller.peer.address);
    return all;
  }

  void notify_start() {
    if (std::exchange(take_->start_sent, true)) return;
    notify(packet_of(*take_, Verb::Start, ""),
           take_->starter ? std::set{take_->starter->peer.address} : std::set<std::uint32_t>{});
  }

  void notify_stop(const char* result) {
    if (std::exchange(take_->stop_sent, true)) return;
    notify(packet_of(*take_, Verb::Stop, result), addresses(take_->stoppers));
  }

  void notify_end(const Take& take, const char* result, bool complete) {
    if (!take.stop_sent) notify(packet_of(take, Verb::Stop, result), addresses(take.stoppers));
    if (!complete) return;
    std::set<std::uint32_t> but = addresses(take.stoppers);
    if (take.starter) but.insert(take.starter->peer.address);
    notify(packet_of(take, Verb::Complete, result), but);
  }

  const TriggerSettings settings_;
  const std::vector<SocketUse> sockets_;
  std::set<std::uint32_t> senders_;
  Receivers receivers_;
  TriggerActions actions_;  // of the call in progress

  RepeatMemory memory_;
  UnlistedSenders unlisted_senders_;
  std::map<std::uint64_t, Caller> pending_;  // by number of the order
  std::uint64_t orders_ = 0;
  std::optional<Take> take_;
  Ended ended_;
};

}  // namespace

std::unique_ptr<TriggerDesk> make_desk(const TriggerSettings& settings, std::uint64_t first_packet_id) {
  return std::make_unique<Desk>(settings, first_packet_id);
}

}  // namespace mocap::trigger
