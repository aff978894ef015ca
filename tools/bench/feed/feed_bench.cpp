#include "bench/feed/feed_bench.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <zmq.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/exit_codes.h"
#include "base/time.h"
#include "bench/feed/snapshot_number.h"
#include "bench/wait_until.h"
#include "support/typical_snapshot.h"
#include "wire/codec/encode.h"
#include "wire/codec/snapshot_encoder.h"
#include "wire/zmq_publisher.h"
#include "wire/zmq_socket.h"

namespace mocap::bench {
namespace {

constexpr std::string_view kTopic{"snapshot\0", 9};
constexpr std::uint64_t kWarmUp = 100;  // messages before the first counted message
constexpr Duration kJoinWithin = std::chrono::seconds(20);

double at(std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0.0;
  return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
}

// Send time of each snapshot number, ns. Written by the publishing thread, read by the receiving thread.
using Clock = std::vector<std::atomic<std::int64_t>>;

class Receivers {
 public:
  Receivers(const Clock& sent, std::uint64_t last) : sent_(sent), last_(last) {}

  Status connect(const std::string& endpoint, int count) {
    for (int i = 0; i < count; ++i) {
      auto& socket = sockets_.emplace_back(std::make_unique<ZmqSocketOf>());
      if (Status opened = socket->socket.open(context_, ZMQ_SUB, endpoint); !opened) return opened;
      static_cast<void>(socket->socket.set(ZMQ_LINGER, 0));
      if (Status set = socket->socket.set(ZMQ_SUBSCRIBE, kTopic); !set) return set;
      if (zmq_connect(socket->socket.get(), endpoint.c_str()) != 0) return wire::zmq_failure(endpoint);
      items_.push_back({socket->socket.get(), 0, ZMQ_POLLIN, 0});
    }
    return {};
  }

  std::size_t joined() const { return joined_.load(); }

  void run(const std::stop_token& stop) {
    wire::ZmqMessage message;
    while (!stop.stop_requested()) {
      if (zmq_poll(items_.data(), static_cast<int>(items_.size()), 20) <= 0) continue;
      for (std::size_t i = 0; i < items_.size(); ++i) {
        if ((items_[i].revents & ZMQ_POLLIN) == 0) continue;
        while (message.receive(sockets_[i]->socket)) take(*sockets_[i], message.bytes());
      }
    }
  }

  std::vector<double> ages_us;  // complete after the end
  std::vector<std::uint64_t> counts() const {
    std::vector<std::uint64_t> all;
    for (const auto& socket : sockets_) all.push_back(socket->counted);
    return all;
  }

 private:
  struct ZmqSocketOf {
    wire::ZmqSocket socket;
    bool joined = false;
    std::uint64_t counted = 0;
  };
  void take(ZmqSocketOf& one, std::string_view bytes) {
    if (!bytes.starts_with(kTopic)) return;  // skip the description
    if (!std::exchange(one.joined, true)) ++joined_;
    const std::uint64_t number = snapshot_number(bytes.substr(kTopic.size()));
    if (number < kWarmUp || number > last_) return;
    ++one.counted;
    ages_us.push_back(1e-3 * static_cast<double>(to_ns(host_now()) - sent_[number].load(std::memory_order_relaxed)));
  }

  const Clock& sent_;
  std::uint64_t last_;
  wire::ZmqContext context_;
  std::vector<std::unique_ptr<ZmqSocketOf>> sockets_;
  std::vector<zmq_pollitem_t> items_;
  std::atomic<std::size_t> joined_{0};
};

double measure_encode_us(const Description& description, Snapshot& snapshot) {
  std::vector<double> spans;
  wire::SnapshotEncoder encoder;
  for (int i = 0; i < 20000; ++i) {
    const Timestamp begun = host_now();
    wire::Parts parts;
    parts.local_positions = !wire::stands_at_rest_offsets(snapshot, description);
    parts.velocities = false;
    const auto bytes = encoder.encode(kTopic, snapshot, parts, {20'000'000, 1'790'000'000'000'000'000, std::nullopt});
    spans.push_back(to_us(host_now() - begun));
    MOCAP_EXPECTS(!bytes.empty());
  }
  std::sort(spans.begin(), spans.end());
  return at(spans, 0.5);
}

// Sends snapshots and raw messages of the same size alternately, each to one subscriber.
Status measure_one_way(const FeedBenchSettings& settings, const Description& description, Snapshot snapshot,
                       FeedBenchFigures& figures) {
  auto publisher = wire::ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  if (!publisher) return publisher.error();
  if (Status described = (*publisher)->describe(description); !described) return described;
  wire::ZmqContext context;
  wire::ZmqSocket raw_sender;
  if (Status opened = raw_sender.open(context, ZMQ_PUB, "raw"); !opened) return opened;
  static_cast<void>(raw_sender.set(ZMQ_LINGER, 0));
  if (zmq_bind(raw_sender.get(), "tcp://127.0.0.1:*") != 0) return wire::zmq_failure("raw");
  const std::uint64_t last = kWarmUp + 600;
  Clock sent(last + 1), raw_sent(last + 1);
  Receivers feed(sent, last), raw(raw_sent, last);
  if (Status joined = feed.connect((*publisher)->endpoint(), 1); !joined) return joined;
  if (Status joined = raw.connect(raw_sender.last_endpoint(), 1); !joined) return joined;
  {
    std::jthread feed_thread([&](const std::stop_token& stop) { feed.run(stop); });
    std::jthread raw_thread([&](const std::stop_token& stop) { raw.run(stop); });
    const Duration half = from_s(0.5 / settings.rate_hz);
    std::string bytes(figures.bytes, '\0');
    Timestamp next = host_now();
    for (std::uint64_t number = 1; number <= last; ++number) {
      wait_until(next += half);
      snapshot.number = number;
      sent[number].store(to_ns(host_now()), std::memory_order_relaxed);
      if (Status done = (*publisher)->publish(snapshot); !done) return done;
      wait_until(next += half);
      bytes.replace(0, kTopic.size(), kTopic);
      bytes[kTopic.size()] = 8;  // field 1, a varint
      for (std::size_t i = 0, rest = number; i < 3; ++i, rest >>= 7) {
        bytes[kTopic.size() + 1 + i] = static_cast<char>((rest & 0x7F) | (i < 2 ? 0x80 : 0));
      }
      raw_sent[number].store(to_ns(host_now()), std::memory_order_relaxed);
      zmq_send(raw_sender.get(), bytes.data(), bytes.size(), ZMQ_DONTWAIT);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  std::sort(feed.ages_us.begin(), feed.ages_us.end());
  std::sort(raw.ages_us.begin(), raw.ages_us.end());
  figures.one_way_p50_us = at(feed.ages_us, 0.5);
  figures.raw_p50_us = at(raw.ages_us, 0.5);
  return {};
}

void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
  }
}

// Size of a snapshot on the wire, with a sequence number of a session that lasts for days.
std::size_t message_bytes(const Snapshot& snapshot) {
  v1::Snapshot message;
  wire::encode(snapshot, message, {.local_positions = false, .velocities = false});
  message.set_utc_minus_host_ns(1'790'000'000'000'000'000);
  message.set_sequence(20'000'000);
  return message.ByteSizeLong() + kTopic.size();
}

}  // namespace

Result<FeedBenchFigures> run_feed_bench(const FeedBenchSettings& settings) {
  raise_descriptor_limit();
  const Description description = support::typical_description();
  Snapshot snapshot = support::typical_snapshot(description);
  FeedBenchFigures figures;
  figures.encode_us = measure_encode_us(description, snapshot);
  figures.bytes = message_bytes(snapshot);

  auto publisher = wire::ZmqPublisher::open(
      {.endpoint = "tcp://127.0.0.1:*", .max_connections = std::max(1000, settings.subscribers + 10)});
  if (!publisher) return publisher.error();
  if (Status described = (*publisher)->describe(description); !described) return described.error();
  const std::uint64_t last = kWarmUp + static_cast<std::uint64_t>(settings.seconds * settings.rate_hz) - 1;
  Clock sent(last + 1);
  Receivers receivers(sent, last);
  receivers.ages_us.reserve((last + 1) * static_cast<std::size_t>(settings.subscribers));
  if (Status joined = receivers.connect((*publisher)->endpoint(), settings.subscribers); !joined) return joined.error();
  std::vector<double> publish_us;
  {
    std::jthread receiving([&](const std::stop_token& stop) { receivers.run(stop); });
    const Duration period = from_s(1.0 / settings.rate_hz);
    const Timestamp begun = host_now();
    Timestamp next = begun;
    snapshot.number = 0;
    while (snapshot.number < last) {
      wait_until(next += period);
      const Timestamp handed = host_now();
      if (snapshot.number == 1 && receivers.joined() < static_cast<std::size_t>(settings.subscribers)) {
        if (handed - begun > kJoinWithin) return Error{ErrorCode::Timeout, "not all subscribers could join"};
        snapshot.number = 0;  // counting starts when all subscribers have joined
      }
      ++snapshot.number;
      sent[snapshot.number].store(to_ns(handed), std::memory_order_relaxed);
      if (Status done = (*publisher)->publish(snapshot); !done) return done.error();
      if (snapshot.number >= kWarmUp) publish_us.push_back(to_us(host_now() - handed));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(500));  // let the last messages arrive
  }
  const auto counts = receivers.counts();
  const auto expected = static_cast<double>(last - kWarmUp + 1);
  std::uint64_t total = 0;
  for (const std::uint64_t count : counts) total += count;
  figures.received_share = static_cast<double>(total) / (expected * settings.subscribers);
  figures.least_share = static_cast<double>(*std::min_element(counts.begin(), counts.end())) / expected;
  std::sort(publish_us.begin(), publish_us.end());
  std::sort(receivers.ages_us.begin(), receivers.ages_us.end());
  figures.publish_p50_us = at(publish_us, 0.5);
  figures.publish_p99_us = at(publish_us, 0.99);
  figures.age_p50_us = at(receivers.ages_us, 0.5);
  figures.age_p99_us = at(receivers.ages_us, 0.99);
  if (Status measured = measure_one_way(settings, description, snapshot, figures); !measured) return measured.error();
  for (const bool keys : {false, true}) {
    Result<JoinFigures> joins = measure_joins(settings.joins, settings.rate_hz, keys);
    if (!joins) return joins.error();
    (keys ? figures.key_joins : figures.open_joins) = *joins;
  }
  return figures;
}

cli::App* add_feed_bench(cli::App& app, FeedBenchSettings& settings) {
  cli::App* feed = app.add_subcommand("feed", "the feed to many subscribers on loopback: received share, age, cost");
  feed->examples("  mocap-bench feed --subscribers 200 --rate 120 --seconds 5 --json");
  feed->add_option("--subscribers", settings.subscribers, "number of subscribers to all snapshots")
      ->check(cli::Range(1, 10000))
      ->capture_default_str();
  feed->add_option("--rate", settings.rate_hz, "snapshot rate, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  feed->add_option("--seconds", settings.seconds, "measured time, s")
      ->check(cli::Range(0.5, 600.0))
      ->capture_default_str();
  feed->add_option("--joins", settings.joins, "number of late joins, one after the other, without and with keys")
      ->check(cli::Range(0, 100000))
      ->capture_default_str();
  return feed;
}

namespace {

nlohmann::ordered_json object_of(const JoinFigures& joins) {
  return {{"joins", joins.joins},
          {"described_first", joins.described_first},
          {"snapshot_periods_p50", joins.periods_p50},
          {"snapshot_periods_p99", joins.periods_p99},
          {"snapshot_periods_max", joins.periods_max}};
}

void print_joins(const char* how, const JoinFigures& joins) {
  fmt::print("{}   {} of {} described first; first snapshot p50 {:.2f}, p99 {:.2f}, max {:.2f} periods\n", how,
             joins.described_first, joins.joins, joins.periods_p50, joins.periods_p99, joins.periods_max);
}

}  // namespace

int print_feed_bench(const FeedBenchSettings& settings, bool json) {
  const Result<FeedBenchFigures> figures = run_feed_bench(settings);
  if (!figures) {
    fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
    return kExitUnavailable;
  }
  const FeedBenchFigures& f = *figures;
  const double ratio = f.raw_p50_us > 0.0 ? f.one_way_p50_us / f.raw_p50_us : 0.0;
  if (json) {
    const nlohmann::ordered_json object{{"subscribers", settings.subscribers},
                                        {"received_share", f.received_share},
                                        {"least_share", f.least_share},
                                        {"publish_p50_us", f.publish_p50_us},
                                        {"publish_p99_us", f.publish_p99_us},
                                        {"age_p50_us", f.age_p50_us},
                                        {"age_p99_us", f.age_p99_us},
                                        {"encode_us", f.encode_us},
                                        {"bytes", f.bytes},
                                        {"one_way_p50_us", f.one_way_p50_us},
                                        {"raw_p50_us", f.raw_p50_us},
                                        {"ratio_raw", ratio},
                                        {"late_joins", object_of(f.open_joins)},
                                        {"late_joins_with_keys", object_of(f.key_joins)}};
    fmt::print("{}\n", object.dump());
    return kExitOk;
  }
  fmt::print("received       {:.3f} % (least {:.3f} %)\npublish        p50 {:.0f} us, p99 {:.0f} us\n",
             100.0 * f.received_share, 100.0 * f.least_share, f.publish_p50_us, f.publish_p99_us);
  fmt::print("age            p50 {:.0f} us, p99 {:.0f} us\nencode         {:.2f} us, {} bytes\n", f.age_p50_us,
             f.age_p99_us, f.encode_us, f.bytes);
  fmt::print("one way        {:.0f} us, raw ZeroMQ {:.0f} us, ratio {:.2f}\n", f.one_way_p50_us, f.raw_p50_us, ratio);
  print_joins("joins       ", f.open_joins);
  print_joins("with keys   ", f.key_joins);
  return kExitOk;
}

}  // namespace mocap::bench
