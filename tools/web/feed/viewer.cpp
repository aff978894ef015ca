#include "web/feed/viewer.h"

#include "base/expects.h"
#include "web/feed/topics.h"

namespace mocap::web {
namespace {

constexpr std::size_t kMaxEvents = 64;
constexpr std::size_t kMaxTexts = 64;

Outgoing text_of(std::string text) { return {std::make_shared<const std::string>(std::move(text)), false}; }

}  // namespace

std::shared_ptr<const std::string> framed(std::string_view topic, std::string_view payload) {
  MOCAP_EXPECTS(topic.size() <= kMaxTopic_bytes);
  std::string bytes;
  bytes.reserve(1 + topic.size() + payload.size());
  bytes += static_cast<char>(topic.size());
  bytes += topic;
  bytes += payload;
  return std::make_shared<const std::string>(std::move(bytes));
}

std::string_view payload_of(const std::string& framed) {
  MOCAP_EXPECTS(!framed.empty());
  return std::string_view(framed).substr(1 + static_cast<unsigned char>(framed[0]));
}

void Viewer::subscribe(Topics topics) {
  topics_ = std::move(topics);
  std::erase_if(newest_, [&](const auto& waiting) { return !wants(waiting.first); });
  if (!wants("event")) events_.clear();
  if (!wants("snapshot")) drawing_ = false;
}

void Viewer::offer(std::string_view topic, const std::shared_ptr<const std::string>& message) {
  if (!wants(topic)) return;
  if (is_queued(topic)) {
    if (events_.size() == kMaxEvents) events_.pop_front();
    events_.push_back(message);
  } else {
    auto& waiting = newest_[std::string(topic)];
    if (waiting != nullptr && topic == "snapshot") ++dropped_snapshots_;
    waiting = message;
    if (topic == "snapshot" && drawing_) return;
  }
  wake_();
}

void Viewer::note_drawn() {
  drawing_ = false;
  wake_();
}

bool Viewer::say(std::string text) {
  if (texts_.size() == kMaxTexts) return false;
  texts_.push_back(std::move(text));
  wake_();
  return true;
}

void Viewer::say_state(std::string text) {
  state_ = std::move(text);
  wake_();
}

std::optional<Outgoing> Viewer::take(std::string_view topic) {
  const auto found = newest_.find(topic);
  if (found == newest_.end()) return std::nullopt;
  Outgoing message{std::move(found->second), true};
  newest_.erase(found);
  return message;
}

std::optional<Outgoing> Viewer::next_in_turn() {
  // The first waiting topic after the last one, so that a topic with a high rate does not starve the others.
  auto at = newest_.upper_bound(last_topic_);
  for (std::size_t tried = 0; tried < newest_.size(); ++tried, ++at) {
    if (at == newest_.end()) at = newest_.begin();
    // Sightings are drawn with a snapshot, so they come at its pace.
    if ((at->first == "snapshot" || at->first == "sightings") && drawing_) continue;
    last_topic_ = at->first;
    if (last_topic_ == "snapshot") {
      drawing_ = true;
      ++sent_snapshots_;
    }
    return take(last_topic_);
  }
  return std::nullopt;
}

std::optional<Outgoing> Viewer::next() {
  if (state_) return text_of(*std::exchange(state_, std::nullopt));
  if (!texts_.empty()) {
    Outgoing message = text_of(std::move(texts_.front()));
    texts_.pop_front();
    return message;
  }
  if (auto description = take("description")) return description;
  if (!events_.empty()) {
    Outgoing message{std::move(events_.front()), true};
    events_.pop_front();
    return message;
  }
  return next_in_turn();
}

}  // namespace mocap::web
