#include "bridges/relay/relay.h"

#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <utility>

#include "base/exit_codes.h"
#include "bridges/relay/topics.h"
#include "wire/codec/lite.h"
#include "wire/zmq_publisher.h"

namespace mocap::relay {
namespace {

constexpr const char* kProgram = "mocap-relay";
constexpr Duration kWait = std::chrono::milliseconds(20);  // the longest time until a signal or a new link is noticed
constexpr int kMostAtOnce = 256;                           // messages of the feed between two looks at the server
constexpr Duration kTick = std::chrono::milliseconds(250);
constexpr Duration kStale = std::chrono::seconds(1);
constexpr Duration kSilence = std::chrono::seconds(3);   // the description comes once a second
constexpr Duration kPatience = std::chrono::seconds(2);  // before the log says why nothing is forwarded
// Topics and subjects that are remembered; the feed has at most a few for each subject.
constexpr std::size_t kMaxTopics = 1024;

volatile std::sig_atomic_t stop_asked = 0;
void ask_stop(int /*signal*/) { stop_asked = 1; }

void say(std::string_view text) {
  fmt::print(stderr, "{}: {}\n", kProgram, text);
  std::fflush(stderr);
}

}  // namespace

Relay::Relay(const RelaySettings& settings, std::unique_ptr<wire::ZmqSubscriber> feed, std::unique_ptr<NatsLink> nats)
    : settings_(settings), feed_(std::move(feed)), nats_(std::move(nats)), status_(kProgram, settings.status_file) {}

Result<std::unique_ptr<Relay>> Relay::open(const RelaySettings& settings) {
  auto feed = wire::ZmqSubscriber::open(settings.feed);
  if (!feed) return feed.error();
  auto nats = NatsLink::open(settings.nats);
  if (!nats) return nats.error();
  return std::unique_ptr<Relay>(new Relay(settings, std::move(*feed), std::move(*nats)));
}

int Relay::run() {
  std::signal(SIGINT, ask_stop);
  std::signal(SIGTERM, ask_stop);
  while (stop_asked == 0 && (settings_.seconds <= 0.0 || to_s(host_now() - started_) < settings_.seconds)) {
    receive();
    forward();  // what waited for the server
    if (const Timestamp now = host_now(); now >= next_tick_) tick(now);
  }
  if (counts_.sent == 0 && diagnosis() != said_) say(diagnosis());
  return counts_.sent > 0 || stop_asked != 0 ? kExitOk : kExitUnavailable;
}

void Relay::receive() {
  Duration patience = kWait;
  for (int i = 0; i < kMostAtOnce; ++i) {
    Result<wire::FeedMessage> message = feed_->next(patience);
    if (!message && message.error().code != ErrorCode::InvalidArgument) return;
    patience = Duration::zero();
    if (message) {
      take(*std::move(message), host_now());
      forward();  // at once, so that two messages of one topic that arrive together are both sent
    } else {
      ++counts_.invalid;
    }
  }
}

void Relay::take(wire::FeedMessage message, Timestamp now) {
  ++counts_.frames;
  last_message_ = now;
  silent_ = false;
  count_lost(message);
  newest_.put(std::move(message), to_ns(now));
}

// The other topics have their sequences inside of Protobuf, which the relay does not read.
void Relay::count_lost(const wire::FeedMessage& message) {
  wire::Lite lite;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(message.payload.data());
  if (!message.topic.starts_with(wire::kLiteTopic) || !wire::decode_lite({bytes, message.payload.size()}, lite)) return;
  if (next_sequence_.size() >= kMaxTopics && !next_sequence_.contains(message.topic)) return;
  const auto [next, is_new] = next_sequence_.try_emplace(message.topic, lite.sequence);
  // A lower number: the daemon started again.
  if (!is_new && lite.sequence > next->second) feed_lost_ += lite.sequence - next->second;
  next->second = lite.sequence + 1;
}

void Relay::forward() {
  while (nats_->ready()) {
    const auto message = newest_.take(to_ns(host_now() - kStale));
    if (!message) break;
    if (nats_->publish(subject_for(message->topic), message->payload)) {
      ++counts_.sent;
      counts_.bytes += message->payload.size();
      counts_.note_added(to_ns(host_now()) - message->arrived_ns);
    } else {
      ++refused_;
    }
  }
  counts_.dropped = newest_.dropped() + refused_;
}

const std::string& Relay::subject_for(const std::string& topic) {
  if (subjects_.size() >= kMaxTopics) subjects_.clear();
  const auto [found, is_new] = subjects_.try_emplace(topic);
  if (is_new) found->second = subject_of(settings_.prefix, topic);
  return found->second;
}

void Relay::tick(Timestamp now) {
  next_tick_ = now + kTick;
  if (!silent_ && now - last_message_ > kSilence) {
    silent_ = true;
    ++counts_.losses;
  }
  say_changes(now);
  write_status(now);
}

std::string Relay::diagnosis() const {
  if (const NatsState nats = nats_->state(); !nats.reason.empty()) return nats.reason;
  const std::string fault =
      explain(feed_->link().fault, settings_.feed.endpoint, {.setting = "[publish] endpoint", .timeout = {}});
  if (!fault.empty()) return fault;
  if (silent_) return fmt::format("{} sends nothing", settings_.feed.endpoint);
  if (!nats_->state().connected) return fmt::format("connects to {}", settings_.nats.server.url());
  return fmt::format("forwards to {}", settings_.nats.server.url());
}

void Relay::say_changes(Timestamp now) {
  std::string now_true = diagnosis();
  // The first seconds are for connecting. The log has a sentence once, not at every attempt.
  if (now_true == said_ || (now - started_ < kPatience && counts_.sent == 0)) return;
  said_ = std::move(now_true);
  say(said_);
}

void Relay::write_status(Timestamp now) {
  const std::string where = settings_.nats.server.url();
  const std::string how = settings_.nats.server.tls ? "NATS, TLS" : "NATS, not encrypted";
  std::vector<bridge::Receiver> receivers;
  if (nats_->state().connected) receivers.push_back({where, how});
  const std::string status = to_json(kProgram, counts_, receivers, diagnosis(), {.lost = feed_lost_});
  status_.write(status);
  if (settings_.statistics_s <= 0.0 || now < next_log_) return;
  next_log_ = now + from_s(settings_.statistics_s);
  say(status);
}

}  // namespace mocap::relay
