#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "web/feed/listener.h"

namespace mocap::web {

/// A message to a client. Several viewers send the same message at the same time, so they share it.
struct Outgoing {
  std::shared_ptr<const std::string> bytes;
  bool binary = false;
};

/// The binary message for a payload of the feed: length of the topic (1 byte), topic, payload.
std::shared_ptr<const std::string> framed(std::string_view topic, std::string_view payload);
/// The payload of a framed() message.
std::string_view payload_of(const std::string& framed);

/// The messages that wait for one page. Bounded: the newest message of each topic, the last 64 events and 64 texts.
/// After a snapshot was sent, the next one waits until the page has drawn it. One thread.
class Viewer : public Listener {
 public:
  /// `wake`: called when a message may have become ready.
  explicit Viewer(std::function<void()> wake) : wake_(std::move(wake)) {}

  void subscribe(Topics topics) override;
  const Topics& topics() const override { return topics_; }

  /// The message replaces the waiting one of this topic; events are queued.
  void offer(std::string_view topic, const std::shared_ptr<const std::string>& message) override;
  /// The page has drawn the snapshot that was sent last.
  void note_drawn();
  /// Queues a text. Returns false if 64 texts wait: the page does not read, and the caller should close the connection.
  bool say(std::string text);
  /// Replaces the waiting state, which is sent before everything else.
  void say_state(std::string text);

  /// The next message to send: state, texts, description, events, then the other topics in turn.
  std::optional<Outgoing> next();

  std::uint64_t dropped_snapshots() const override { return dropped_snapshots_; }
  std::uint64_t sent_snapshots() const { return sent_snapshots_; }

 private:
  std::optional<Outgoing> take(std::string_view topic);
  std::optional<Outgoing> next_in_turn();

  std::function<void()> wake_;
  Topics topics_;
  std::map<std::string, std::shared_ptr<const std::string>, std::less<>> newest_;  // by topic
  std::deque<std::shared_ptr<const std::string>> events_;
  std::deque<std::string> texts_;
  std::optional<std::string> state_;
  std::string last_topic_;  // whose turn it was
  bool drawing_ = false;    // a snapshot was sent and not drawn yet
  std::uint64_t dropped_snapshots_ = 0;
  std::uint64_t sent_snapshots_ = 0;
};

}  // namespace mocap::web
