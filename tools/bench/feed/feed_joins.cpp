#include "bench/feed/feed_joins.h"

#include <fmt/format.h>
#include <zmq.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "base/time.h"
#include "runtime/publish_worker.h"
#include "support/temporary_folder.h"
#include "support/typical_snapshot.h"
#include "wire/curve_keys.h"
#include "wire/zmq_publisher.h"
#include "wire/zmq_socket.h"

namespace mocap::bench {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPatience = std::chrono::seconds(10);
constexpr std::string_view kSnapshot{"snapshot\0", 9}, kDescription{"description\0", 12};

// A feed at a constant rate, served as by the daemon's publish thread.
class RunningFeed {
 public:
  static Result<std::unique_ptr<RunningFeed>> start(double rate_hz, bool keys) {
    auto made = std::make_unique<RunningFeed>();
    wire::PublisherSettings settings{.endpoint = "tcp://127.0.0.1:*"};
    if (keys) {
      for (wire::KeyPair* pair : {&made->server, &made->own}) {
        Result<wire::KeyPair> fresh = wire::new_key_pair();
        if (!fresh) return fresh.error();
        *pair = *fresh;
      }
      settings.curve = {made->folder_.path() / "server.key", made->folder_.path() / "allowed.keys"};
      if (Status saved = wire::save_key_pair(settings.curve.server_key, made->server); !saved) return saved.error();
      const std::vector<wire::AllowedKey> allowed{{made->own.public_key, wire::Role::Viewer, "bench"}};
      if (Status saved = wire::save_allowed_keys(settings.curve.allowed, allowed); !saved) return saved.error();
    }
    auto publisher = wire::ZmqPublisher::open(settings);
    if (!publisher) return publisher.error();
    made->publisher_ = std::move(*publisher);
    const Description description = support::typical_description();
    if (Status described = made->publisher_->describe(description); !described) return described.error();
    made->thread_ = std::jthread([feed = made.get(), rate_hz, snapshot = support::typical_snapshot(description)](
                                     const std::stop_token& stop) mutable { feed->run(stop, rate_hz, snapshot); });
    return made;
  }
  const std::string& endpoint() const { return publisher_->endpoint(); }

  wire::KeyPair server, own;

 private:
  void run(const std::stop_token& stop, double rate_hz, Snapshot& snapshot) {
    const Duration period = from_s(1.0 / rate_hz);
    Timestamp next = host_now();
    while (!stop.stop_requested()) {
      next += period;
      for (Timestamp now = host_now(); now < next; now = host_now()) {
        publisher_->serve();
        std::this_thread::sleep_until(std::min(next, now + runtime::kServeEvery));
      }
      ++snapshot.number;
      static_cast<void>(publisher_->publish(snapshot));
    }
  }

  support::TemporaryFolder folder_;
  std::unique_ptr<wire::ZmqPublisher> publisher_;
  std::jthread thread_;
};

Status prepare(wire::ZmqSocket& socket, const wire::ZmqContext& context, const RunningFeed& feed) {
  if (Status opened = socket.open(context, ZMQ_SUB, feed.endpoint()); !opened) return opened;
  static_cast<void>(socket.set(ZMQ_LINGER, 0));
  if (!feed.server.public_key.empty()) {
    for (const auto& [option, key] : {std::pair{ZMQ_CURVE_SERVERKEY, &feed.server.public_key},
                                      {ZMQ_CURVE_PUBLICKEY, &feed.own.public_key},
                                      {ZMQ_CURVE_SECRETKEY, &feed.own.secret_key}}) {
      if (Status set = socket.set(option, std::string_view(*key)); !set) return set;
    }
  }
  for (const std::string_view topic : {kDescription, kSnapshot}) {
    if (Status set = socket.set(ZMQ_SUBSCRIBE, topic); !set) return set;
  }
  return {};
}

struct Join {
  bool described_first = false;
  Duration until_snapshot{};
};

Result<Join> join(const wire::ZmqContext& context, const RunningFeed& feed) {
  wire::ZmqSocket socket;
  if (Status ready = prepare(socket, context, feed); !ready) return ready.error();
  Join seen;
  const Timestamp begun = host_now();
  if (zmq_connect(socket.get(), feed.endpoint().c_str()) != 0) return wire::zmq_failure(feed.endpoint());
  wire::ZmqMessage message;
  for (bool first = true; host_now() - begun < kPatience;) {
    zmq_pollitem_t item{socket.get(), 0, ZMQ_POLLIN, 0};
    zmq_poll(&item, 1, 100);
    while (message.receive(socket)) {
      if (std::exchange(first, false)) seen.described_first = message.bytes().starts_with(kDescription);
      if (!message.bytes().starts_with(kSnapshot)) continue;
      seen.until_snapshot = host_now() - begun;
      return seen;
    }
  }
  return Error{ErrorCode::Timeout, "a subscriber joined and received no snapshot for 10 s"};
}

}  // namespace

Result<JoinFigures> measure_joins(int joins, double rate_hz, bool keys) {
  auto feed = RunningFeed::start(rate_hz, keys);
  if (!feed) return feed.error();
  const wire::ZmqContext context;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> pause_s(0.0, 1.0 / rate_hz);
  JoinFigures figures;
  std::vector<double> periods;
  for (; figures.joins < joins; ++figures.joins) {
    std::this_thread::sleep_for(from_s(pause_s(random)));
    const Result<Join> seen = join(context, **feed);
    if (!seen) return seen.error();
    figures.described_first += seen->described_first ? 1 : 0;
    periods.push_back(to_s(seen->until_snapshot) * rate_hz);
  }
  if (periods.empty()) return figures;
  std::sort(periods.begin(), periods.end());
  const auto at = [&](double share) {
    return periods[std::min(periods.size() - 1, static_cast<std::size_t>(share * static_cast<double>(periods.size())))];
  };
  figures.periods_p50 = at(0.5);
  figures.periods_p99 = at(0.99);
  figures.periods_max = periods.back();
  return figures;
}

}  // namespace mocap::bench
