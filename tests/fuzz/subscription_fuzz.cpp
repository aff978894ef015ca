#include <zmq.h>

#include <chrono>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "base/expects.h"
#include "base/log.h"
#include "base/time.h"
#include "fuzz/fuzz_arguments.h"
#include "model/description.h"
#include "wire/subscriptions.h"
#include "wire/zmq_publisher.h"
#include "wire/zmq_subscriber.h"

// Fuzzes a real publisher, whose description changes, with peers that subscribe to random topics, end subscriptions
// that they never made, send malformed messages and disconnect at any time. Also fuzzes Subscriptions alone: its bounds
// must hold, and its counts must return to zero.
//
// usage: subscription_fuzz [COUNT [SEED]]

namespace mocap::wire {
namespace {

class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed) : random_(seed), context_(zmq_ctx_new()) {
    auto opened = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*", .max_connections = 20});
    MOCAP_EXPECTS(opened.has_value());
    publisher_ = std::move(*opened);
    redescribe();
  }
  ~Fuzz() {
    for (void* peer : peers_) zmq_close(peer);
    zmq_ctx_term(context_);
  }
  Fuzz(const Fuzz&) = delete;
  Fuzz& operator=(const Fuzz&) = delete;

  void try_once() {
    if (peers_.size() < 30 && below(10) == 0) connect();
    if (!peers_.empty() && below(20) == 0) {
      zmq_close(peers_.back());
      peers_.pop_back();
    }
    for (void* peer : peers_) {
      const std::string bytes = message();
      zmq_send(peer, bytes.data(), bytes.size(), ZMQ_DONTWAIT);
    }
    if (below(50) == 0) redescribe();
    Snapshot& snapshot = snapshot_;
    ++snapshot.number;
    MOCAP_EXPECTS(publisher_->publish(snapshot).has_value());
    if (below(20) == 0) MOCAP_EXPECTS(publisher_->report({}).has_value());
    try_alone();
  }

  // After the hostile peers have gone, a normal subscriber must receive the description first. It waits until the
  // publisher has read what the peers left.
  void check_still_well() {
    for (void* peer : peers_) zmq_close(peer);
    peers_.clear();
    SubscriberSettings settings;
    settings.endpoint = publisher_->endpoint();
    const auto subscriber = std::move(*ZmqSubscriber::open(settings));
    Result<FeedMessage> first = subscriber->next(std::chrono::milliseconds(5));
    const Timestamp give_up = host_now() + std::chrono::minutes(4);
    while (!first && host_now() < give_up) {
      publisher_->serve();
      first = subscriber->next(std::chrono::milliseconds(5));
    }
    MOCAP_EXPECTS(first.has_value() && first->topic == "description");
  }

 private:
  int below(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }

  std::string message() {
    static constexpr const char* kTopics[] = {"snapshot", "subject/", "subject/a", "description", "", "s", "markers"};
    std::string topic = kTopics[random_() % std::size(kTopics)];
    if (below(3) == 0) topic += '\0';
    if (below(4) == 0) topic += std::to_string(below(100'000));
    if (below(50) == 0) topic.append(static_cast<std::size_t>(below(9000)), 'x');
    const char first = below(10) == 0 ? static_cast<char>(random_()) : below(3) == 0 ? '\0' : '\1';
    return below(100) == 0 ? std::string() : first + topic;
  }

  void connect() {
    void* peer = zmq_socket(context_, ZMQ_XSUB);
    const int off = 0;
    zmq_setsockopt(peer, ZMQ_LINGER, &off, sizeof(off));
    zmq_connect(peer, publisher_->endpoint().c_str());
    peers_.push_back(peer);
  }

  void redescribe() {
    Description description;
    description.version = ++version_;
    for (int i = below(4); i > 0; --i) {
      description.subjects.emplace_back();
      description.subjects.back().name = std::string(static_cast<std::size_t>(i), 'a');
    }
    MOCAP_EXPECTS(publisher_->describe(description).has_value());
  }

  // Adds many subscriptions, then ends them all; none may remain.
  void try_alone() {
    Subscriptions alone;
    alone.set_topics({std::string("snapshot\0", 9), std::string("subject/a\0", 10)});
    std::vector<std::string> began;
    for (int i = below(400); i > 0; --i) {
      const std::string bytes = message();
      const auto verdict = alone.take(bytes, below(5) - 1);
      if (verdict == Subscriptions::Verdict::Fine && !bytes.empty() && bytes[0] == '\1') began.push_back(bytes);
      MOCAP_EXPECTS(alone.count() <= 4096);
    }
    for (std::string& bytes : began) {
      bytes[0] = '\0';
      static_cast<void>(alone.take(bytes, -1));
    }
    MOCAP_EXPECTS(alone.count() == 0 && !alone.wanted(0) && !alone.wanted(1));
  }

  std::mt19937_64 random_;
  void* context_;
  std::unique_ptr<ZmqPublisher> publisher_;
  std::vector<void*> peers_;
  Snapshot snapshot_;
  std::uint32_t version_ = 0;
};

}  // namespace
}  // namespace mocap::wire

int main(int argc, char** argv) {
  const mocap::fuzz::Arguments arguments(argc, argv);
  mocap::set_log_level(mocap::LogLevel::Error);
  {
    mocap::wire::Fuzz fuzz(arguments.seed);
    for (std::uint64_t i = 0; i < arguments.count; ++i) fuzz.try_once();
    fuzz.check_still_well();
  }
  arguments.print("rounds");
  return 0;
}
