#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "web/dialogue.h"
#include "web/feed/hub.h"
#include "web/feed/listener.h"
#include "web/foxglove/foxglove_channels.h"

namespace mocap::web {

/// Two names of the same protocol; Foxglove since 2025 offers the first.
inline constexpr std::array<const char*, 2> kFoxgloveSubprotocols = {"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// The dialogue with a Foxglove client (Foxglove WebSocket protocol v1,
/// https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md). It offers what a viewer may see, and takes nothing
/// but subscriptions. Of each subscription only the newest message waits.
class FoxgloveDialogue : public Dialogue, private Listener {
 public:
  FoxgloveDialogue(Hub& hub, Connection connection);
  ~FoxgloveDialogue() override;
  FoxgloveDialogue(const FoxgloveDialogue&) = delete;
  FoxgloveDialogue& operator=(const FoxgloveDialogue&) = delete;

  void take(const std::string& message, bool is_text) override;
  std::optional<Outgoing> next() override;
  void note_time(Timestamp now) override;

 private:
  void subscribe(Topics topics) override { topics_ = std::move(topics); }
  const Topics& topics() const override { return topics_; }
  void offer(std::string_view topic, const std::shared_ptr<const std::string>& message) override;
  std::uint64_t dropped_snapshots() const override { return dropped_; }

  void add_subscription(std::optional<std::uint32_t> id, std::optional<std::uint32_t> channel);
  void remove_subscription(const nlohmann::json& id);
  void follow_channels();
  void update_topics();
  void say(std::string text);
  void warn(const std::string& what);
  std::optional<std::string> encoded(std::uint32_t subscription, std::string_view payload) const;

  Hub& hub_;
  Connection connection_;
  Channels channels_;
  Topics topics_;
  std::map<std::uint32_t, std::uint32_t> subscriptions_;                 // channel by subscription
  std::map<std::uint32_t, std::shared_ptr<const std::string>> waiting_;  // message by subscription
  std::uint32_t last_sent_ = 0;                                          // whose turn it was
  std::deque<std::string> texts_;
  std::optional<std::string> link_reason_;  // why there is no data, as the client was told
  std::uint64_t dropped_ = 0;
};

}  // namespace mocap::web
