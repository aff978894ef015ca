#pragma once

#include <fmt/format.h>

#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <memory>
#include <string>
#include <utility>

#include "web/feed/page_message.h"
#include "web/feed/viewer.h"
#include "web/http/any_stream.h"
#include "web/http/shared.h"
#include "web/token_bucket.h"

namespace mocap::web {

inline constexpr std::size_t kMaxPageMessage_bytes = 64 * 1024;
inline constexpr int kMaxRequestsInWork = 8;  ///< of one page
inline constexpr const char* kSubprotocol = "mocap.v1";

/// The WebSocket of one page. Its handlers keep it alive.
class PageSession : public std::enable_shared_from_this<PageSession> {
 public:
  PageSession(AnyStream stream, Shared& shared, Place place, Visitor visitor, std::string remote)
      : socket_(std::move(stream)),
        shared_(shared),
        place_(std::move(place)),
        visitor_(std::move(visitor)),
        remote_(std::move(remote)),
        viewer_([this] { send_next(); }) {}

  ~PageSession() {
    if (!joined_) return;
    shared_.pages.erase(this);
    shared_.hub.leave(viewer_);
    shared_.topics_changed();
  }
  PageSession(const PageSession&) = delete;
  PageSession& operator=(const PageSession&) = delete;

  void start(const http::request<http::string_body>& request) {
    lowest().expires_never();
    socket_.set_option(websocket::stream_base::timeout{shared_.timeout, shared_.timeout, true});
    socket_.set_option(websocket::stream_base::decorator(
        [](websocket::response_type& response) { response.set(http::field::sec_websocket_protocol, kSubprotocol); }));
    socket_.read_message_max(kMaxPageMessage_bytes);
    socket_.auto_fragment(false);
    socket_.control_callback([this](websocket::frame_type, beast::string_view) { note_message(); });
    lowest().socket().set_option(tcp::no_delay(true), ignored_);
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (!error) self->join();
    });
  }

  void say_state(Timestamp now) {
    viewer_.say_state(shared_.site.state_text(visitor_, now));
    if (const auto dropped = viewer_.dropped_snapshots(); dropped != dropped_said_) {
      dropped_said_ = dropped;
      say(fmt::format(R"({{"dropped":{{"snapshot":{}}}}})", dropped));
    }
  }

  /// Cuts a page that does not read.
  void check(Timestamp now) {
    if (sending_ && now - sending_since_ > shared_.timeout) cut("slow");
  }

 private:
  AnyStream::Tcp& lowest() { return beast::get_lowest_layer(socket_); }

  void join() {
    joined_ = true;
    shared_.pages.insert(this);
    shared_.hub.join(viewer_);
    say_state(host_now());
    receive();
  }

  void receive() {
    socket_.async_read(received_, [self = shared_from_this()](error_code error, std::size_t /*bytes*/) {
      if (error) return self->close();
      self->take();
    });
  }

  void take() {
    const std::string text = beast::buffers_to_string(received_.data());
    received_.consume(received_.size());
    if (!note_message()) return;
    Result<PageMessage> message = Error{ErrorCode::InvalidArgument, "expected text, this message is binary"};
    if (socket_.got_text()) message = read_page_message(text);
    if (message) {
      std::visit([this](auto&& each) { execute(std::move(each)); }, *std::move(message));
    } else {
      shared_.site.note_refused("message");
      say(error_text(0, "CODE_INVALID", message.error().message));
    }
    if (!closed_) receive();
  }

  void execute(SubscribeMessage&& message) {
    shared_.hub.subscribe(viewer_, std::move(message.topics));
    shared_.topics_changed();
  }
  void execute(DrawnMessage&& /*message*/) { viewer_.note_drawn(); }
  void execute(RequestMessage&& message) {
    if (in_work_ == kMaxRequestsInWork) {
      return say(error_text(message.id, "CODE_FAILED", "eight requests of this page wait for their answer"));
    }
    ++in_work_;
    shared_.site.answer(message, visitor_, remote_, [self = shared_from_this()](std::string text) {
      --self->in_work_;
      self->say(std::move(text));
    });
  }

  // Counts a message of the page, or a ping; cuts a page that floods. A page draws at most 240 times a second.
  bool note_message() {
    if (messages_.take(host_now())) return true;
    cut("flood");
    return false;
  }

  void say(std::string text) {
    if (!closed_ && !viewer_.say(std::move(text))) cut("slow");
  }

  void send_next() {
    if (sending_ || closed_ || !joined_) return;
    auto message = viewer_.next();
    if (!message) return;
    sending_ = true;
    sending_since_ = host_now();
    socket_.binary(message->binary);
    const auto bytes = message->bytes;
    socket_.async_write(asio::buffer(*bytes), [self = shared_from_this(), bytes](error_code error, std::size_t count) {
      self->sending_ = false;
      if (error) return self->close();
      WebCounts& counts = self->shared_.site.counts();
      ++counts.messages;
      counts.bytes += count;
      self->send_next();
    });
  }

  void cut(const std::string& reason) {
    if (closed_) return;
    shared_.site.note_refused(reason);
    close();
  }

  void close() {
    closed_ = true;
    lowest().close();
  }

  websocket::stream<AnyStream, false>
      socket_;  // false: no compression, which costs a page and the server more than it saves
  Shared& shared_;
  Place place_;
  Visitor visitor_;
  std::string remote_;
  Viewer viewer_;
  beast::flat_buffer received_{kMaxPageMessage_bytes};
  TokenBucket messages_{300.0, 600.0};
  error_code ignored_;
  int in_work_ = 0;
  bool joined_ = false;
  bool sending_ = false;
  bool closed_ = false;
  Timestamp sending_since_;
  std::uint64_t dropped_said_ = 0;
};

}  // namespace mocap::web
