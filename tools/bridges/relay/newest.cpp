#include "bridges/relay/newest.h"

#include <algorithm>
#include <utility>

#include "wire/codec/lite.h"
#include "wire/zmq_publisher.h"

namespace mocap::relay {
namespace {

bool is_description(const std::string& topic) { return topic == wire::kDescriptionTopic; }

// The same topic, and the same bones of the subject.
bool is_newer(const wire::FeedMessage& message, const Newest::Message& waiting) {
  if (message.topic != waiting.topic) return false;
  const std::size_t part = wire::kLiteFirstBone;
  return !message.topic.starts_with(wire::kLiteTopic) || message.payload.size() <= part ||
         waiting.payload.size() <= part || message.payload[part] == waiting.payload[part];
}

}  // namespace

void Newest::put(wire::FeedMessage message, std::int64_t arrived_ns) {
  const auto same = std::ranges::find_if(waiting_, [&](const Message& one) { return is_newer(message, one); });
  if (same != waiting_.end()) {
    if (!is_description(message.topic)) ++dropped_;
    same->payload = std::move(message.payload);
    same->arrived_ns = arrived_ns;
    return;
  }
  if (waiting_.size() >= kMaxWaiting) {
    ++dropped_;
    return;
  }
  const auto at = is_description(message.topic) ? waiting_.begin() : waiting_.end();
  waiting_.insert(at, Message{std::move(message.topic), std::move(message.payload), arrived_ns});
}

std::optional<Newest::Message> Newest::take(std::int64_t not_before_ns) {
  while (!waiting_.empty()) {
    Message first = std::move(waiting_.front());
    waiting_.pop_front();
    if (is_description(first.topic) || first.arrived_ns >= not_before_ns) return first;
    ++dropped_;
  }
  return std::nullopt;
}

}  // namespace mocap::relay
