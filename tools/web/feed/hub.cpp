#include "web/feed/hub.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "web/feed/viewer.h"

namespace mocap::web {
namespace {

constexpr Duration kSilence = std::chrono::seconds(3);  // health comes once a second

}  // namespace

void Hub::leave(Listener& viewer) {
  dropped_before_ += viewer.dropped_snapshots();
  std::erase(viewers_, &viewer);
}

void Hub::subscribe(Listener& viewer, Topics topics) {
  viewer.subscribe(std::move(topics));
  if (description_message_ != nullptr) viewer.offer("description", description_message_);
  if (health_message_ != nullptr) viewer.offer("health", health_message_);
}

Topics Hub::topics() const {
  Topics all{"description", "health", "event"};
  for (const Listener* viewer : viewers_) all.insert(viewer->topics().begin(), viewer->topics().end());
  return all;
}

void Hub::take(std::vector<wire::FeedMessage> messages, Timestamp now) {
  for (const wire::FeedMessage& message : messages) {
    arrived_ = now;
    const bool wanted =
        std::ranges::any_of(viewers_, [&](const Listener* viewer) { return viewer->wants(message.topic); });
    const bool kept = message.topic == "description" || message.topic == "health";
    if (!wanted && !kept) continue;
    const auto bytes = framed(message.topic, message.payload);
    if (message.topic == "description") description_message_ = bytes;
    if (message.topic == "health") health_message_ = bytes;
    if (kept) keep(message);
    for (Listener* viewer : viewers_) viewer->offer(message.topic, bytes);
  }
}

void Hub::note_link(const wire::LinkStatus& link) {
  if (link_.connected && !link.connected) {
    description_.reset();
    health_.reset();
    description_message_.reset();
    health_message_.reset();
  }
  link_ = link;
}

void Hub::keep(const wire::FeedMessage& message) {
  if (message.topic == "health") {
    v1::Health health;
    if (health.ParseFromString(message.payload)) health_ = std::move(health);
  } else {
    v1::Description description;
    if (description.ParseFromString(message.payload)) description_ = std::move(description);
  }
}

FeedStatus Hub::status(Timestamp now) const {
  FeedStatus status;
  const Duration age = now - arrived_.value_or(started_);
  status.age_s = to_s(age);
  status.connected = link_.connected && arrived_ && age < kSilence;
  if (status.connected) return status;
  status.reason = wire::explain(link_.fault, endpoint_, {"[publish] endpoint"});
  if (!status.reason.empty()) return status;
  status.reason = link_.connected ? fmt::format("{}: connected, but no data for {:.0f} s", endpoint_, status.age_s)
                                  : fmt::format("{}: connecting", endpoint_);
  return status;
}

std::uint64_t Hub::dropped_snapshots() const {
  std::uint64_t dropped = dropped_before_;
  for (const Listener* viewer : viewers_) dropped += viewer->dropped_snapshots();
  return dropped;
}

}  // namespace mocap::web
