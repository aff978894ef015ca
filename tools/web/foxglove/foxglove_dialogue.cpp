#include "web/foxglove/foxglove_dialogue.h"

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "lib/json_depth.h"
#include "web/feed/topics.h"
#include "web/foxglove/foxglove_messages.h"

namespace mocap::web {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxTexts = 64;
constexpr char kMessageData = 1;  // opcode of a binary message

enum Level { kInfo = 0, kWarning = 1 };

std::string status_text(Level level, const std::string& message) {
  return json{{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}}.dump(
      -1, ' ', false, json::error_handler_t::replace);
}

std::string server_info() {
  return json{{"op", "serverInfo"}, {"name", "mocap-web " MOCAP_VERSION}, {"capabilities", json::array()}}.dump();
}

// The number under `key`; empty if there is none, or if it is not a whole number of 32 bits.
std::optional<std::uint32_t> number_in(const json& object, const char* key) {
  if (!object.is_object() || !object.contains(key) || !object[key].is_number_unsigned()) return std::nullopt;
  const auto value = object[key].get<std::uint64_t>();
  if (value > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(value);
}

// The list under `key`; empty if there is none.
json list_in(const json& object, const char* key) {
  if (!object.contains(key) || !object[key].is_array()) return json::array();
  return object[key];
}

void append_little_endian(std::string& bytes, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) bytes += static_cast<char>(value >> 8U * static_cast<unsigned>(i));
}

std::string message_data(std::uint32_t subscription, std::int64_t utc_ns,
                         const google::protobuf::MessageLite& message) {
  std::string bytes(1, kMessageData);
  append_little_endian(bytes, subscription, 4);
  append_little_endian(bytes, static_cast<std::uint64_t>(utc_ns), 8);
  message.AppendToString(&bytes);
  return bytes;
}

template <class Message>
std::optional<Message> parsed(std::string_view payload) {
  Message message;
  if (!message.ParseFromArray(payload.data(), static_cast<int>(payload.size()))) return std::nullopt;
  return message;
}

}  // namespace

FoxgloveDialogue::FoxgloveDialogue(Hub& hub, Connection connection) : hub_(hub), connection_(std::move(connection)) {
  say(server_info());
  say(channels_.advertisement());
  hub_.join(*this);
  update_topics();
}

FoxgloveDialogue::~FoxgloveDialogue() {
  hub_.leave(*this);
  connection_.topics_changed();
}

void FoxgloveDialogue::take(const std::string& message, bool is_text) {
  const json said = is_text && !is_deep(message) ? json::parse(message, nullptr, false) : json();
  const std::string op = said.is_object() ? said.value("op", json()).dump() : "";
  if (op == "\"subscribe\"") {
    for (const json& each : list_in(said, "subscriptions")) {
      add_subscription(number_in(each, "id"), number_in(each, "channelId"));
    }
  } else if (op == "\"unsubscribe\"") {
    for (const json& id : list_in(said, "subscriptionIds")) remove_subscription(id);
  } else {
    connection_.note_refused("message");
    return warn("expected the operation subscribe or unsubscribe as JSON text");
  }
  update_topics();
}

void FoxgloveDialogue::add_subscription(std::optional<std::uint32_t> id, std::optional<std::uint32_t> channel) {
  if (!id || !channel) return warn("subscribe: expected id and channelId as whole numbers");
  if (subscriptions_.size() == kMaxTopics) return warn(fmt::format("subscribe: at most {} channels", kMaxTopics));
  if (channels_.find(*channel) == nullptr) return warn(fmt::format("subscribe: there is no channel {}", *channel));
  if (!subscriptions_.try_emplace(*id, *channel).second) warn(fmt::format("subscribe: the id {} is in use", *id));
}

void FoxgloveDialogue::remove_subscription(const nlohmann::json& id) {
  const auto number = number_in(json{{"id", id}}, "id");
  if (!number || subscriptions_.erase(*number) == 0) return warn("unsubscribe: there is no such subscription");
  waiting_.erase(*number);
}

void FoxgloveDialogue::update_topics() {
  Topics topics{"description"};
  for (const auto& [id, channel] : subscriptions_) topics.insert(channels_.find(channel)->source);
  hub_.subscribe(*this, std::move(topics));
  connection_.topics_changed();
}

void FoxgloveDialogue::offer(std::string_view topic, const std::shared_ptr<const std::string>& message) {
  if (topic == "description") follow_channels();
  for (const auto& [id, channel] : subscriptions_) {
    if (channels_.find(channel)->source != topic) continue;
    auto& waiting = waiting_[id];
    if (waiting != nullptr && topic == "snapshot") ++dropped_;
    waiting = message;
  }
  connection_.wake();
}

void FoxgloveDialogue::follow_channels() {
  if (hub_.description() == nullptr) return;
  for (std::string& text : channels_.update(*hub_.description())) say(std::move(text));
  std::erase_if(subscriptions_, [&](const auto& entry) { return channels_.find(entry.second) == nullptr; });
  std::erase_if(waiting_, [&](const auto& entry) { return !subscriptions_.contains(entry.first); });
}

std::optional<Outgoing> FoxgloveDialogue::next() {
  if (!texts_.empty()) {
    Outgoing text{std::make_shared<const std::string>(std::move(texts_.front())), false};
    texts_.pop_front();
    return text;
  }
  // The subscriptions in turn, so that a channel with a high rate does not starve the others.
  while (!waiting_.empty()) {
    auto at = waiting_.upper_bound(last_sent_);
    if (at == waiting_.end()) at = waiting_.begin();
    last_sent_ = at->first;
    const auto message = at->second;
    waiting_.erase(at);
    if (auto bytes = encoded(last_sent_, payload_of(*message))) {
      return Outgoing{std::make_shared<const std::string>(*std::move(bytes)), true};
    }
  }
  return std::nullopt;
}

std::optional<std::string> FoxgloveDialogue::encoded(std::uint32_t subscription, std::string_view payload) const {
  const Channel& channel = *channels_.find(subscriptions_.at(subscription));
  const v1::Description* description = hub_.description();
  if (description == nullptr) return std::nullopt;
  if (channel.content == ChannelContent::Image) {
    const auto preview = parsed<v1::Preview>(payload);
    if (!preview || hub_.health() == nullptr) return std::nullopt;  // without health its time in UTC is unknown
    const std::int64_t utc_minus_host_ns = hub_.health()->utc_minus_host_ns();
    return message_data(subscription, preview->exposed_at_ns() + utc_minus_host_ns,
                        image_of(*preview, channel.camera, utc_minus_host_ns));
  }
  if (channel.content == ChannelContent::Cameras) {
    const std::int64_t now_ns = to_ns(host_now() + utc_minus_host());  // the daemon may be on another machine
    return message_data(subscription, now_ns, cameras_of(*description, now_ns));
  }
  const auto snapshot = parsed<v1::Snapshot>(payload);
  if (!snapshot) return std::nullopt;
  const std::int64_t at_ns = exposed_utc_ns(*snapshot);
  if (channel.content == ChannelContent::Bones) {
    return message_data(subscription, at_ns, bones_of(*snapshot, *description));
  }
  return message_data(subscription, at_ns, scene_of(*snapshot, *description));
}

void FoxgloveDialogue::note_time(Timestamp now) {
  const FeedStatus status = hub_.status(now);
  if (status.connected != link_reason_.has_value()) return;
  link_reason_ = status.connected ? std::nullopt : std::optional(status.reason);
  say(status.connected ? status_text(kInfo, "the feed arrives") : status_text(kWarning, "no data: " + status.reason));
}

void FoxgloveDialogue::warn(const std::string& what) { say(status_text(kWarning, what)); }

void FoxgloveDialogue::say(std::string text) {
  if (texts_.size() == kMaxTexts) return connection_.cut("slow");
  texts_.push_back(std::move(text));
  connection_.wake();
}

}  // namespace mocap::web
