#include "web/feed/feed_reader.h"

#include <chrono>
#include <utility>

#include "web/feed/topics.h"

namespace mocap::web {
namespace {

constexpr Duration kPatience = std::chrono::milliseconds(20);
constexpr std::size_t kMaxUnreadEvents = 256;

}  // namespace

Result<std::unique_ptr<FeedReader>> FeedReader::open(const wire::SubscriberSettings& settings,
                                                     std::function<void()> wake) {
  auto subscriber = wire::ZmqSubscriber::open(settings);
  if (!subscriber) return subscriber.error();
  return std::unique_ptr<FeedReader>(new FeedReader(*std::move(subscriber), std::move(wake)));
}

FeedReader::FeedReader(std::unique_ptr<wire::ZmqSubscriber> subscriber, std::function<void()> wake)
    : subscriber_(std::move(subscriber)),
      wake_(std::move(wake)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

FeedReader::~FeedReader() = default;

void FeedReader::want(std::set<std::string, std::less<>> topics) {
  const std::lock_guard lock(mutex_);
  wanted_.assign(topics.begin(), topics.end());
  topics_changed_ = true;
}

std::vector<wire::FeedMessage> FeedReader::take() {
  const std::lock_guard lock(mutex_);
  std::vector<wire::FeedMessage> all;
  all.reserve(newest_.size() + events_.size());
  // "description" precedes "event", and all other topics follow in the order of the alphabet.
  if (auto described = newest_.extract("description")) all.push_back({"description", std::move(described.mapped())});
  for (std::string& event : events_) all.push_back({"event", std::move(event)});
  for (auto& [topic, payload] : newest_) all.push_back({topic, std::move(payload)});
  events_.clear();
  newest_.clear();
  return all;
}

wire::LinkStatus FeedReader::link() const {
  const std::lock_guard lock(mutex_);
  return link_;
}

void FeedReader::follow_topics() {
  std::vector<std::string> topics;
  {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(topics_changed_, false)) return;
    topics = wanted_;
  }
  static_cast<void>(subscriber_->subscribe(std::move(topics)));  // fails only if the socket does, as receive() does too
}

bool FeedReader::receive(Duration patience) {
  Result<wire::FeedMessage> message = subscriber_->next(patience);
  const std::lock_guard lock(mutex_);
  link_ = subscriber_->link();
  if (!message) return message.error().code == ErrorCode::InvalidArgument;
  if (message->topic.size() > kMaxTopic_bytes) return true;
  if (!is_queued(message->topic)) {
    newest_[message->topic] = std::move(message->payload);
    return true;
  }
  if (events_.size() == kMaxUnreadEvents) events_.pop_front();
  events_.push_back(std::move(message->payload));
  return true;
}

void FeedReader::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    follow_topics();
    if (!receive(kPatience)) continue;
    constexpr int kAtOnce = 64;  // so that the list of topics is followed under any load
    for (int more = 1; more < kAtOnce && receive(Duration(0));) ++more;
    wake_();
  }
}

}  // namespace mocap::web
