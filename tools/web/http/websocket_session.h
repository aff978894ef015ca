#pragma once

#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "web/dialogue.h"
#include "web/http/any_stream.h"
#include "web/http/shared.h"
#include "web/token_bucket.h"

namespace mocap::web {

inline constexpr std::size_t kMaxClientMessage_bytes = 64 * 1024;

/// One WebSocket: its frames, bounds and time limits. A Dialogue says what is sent. Its handlers keep it alive.
class WebSocketSession : public std::enable_shared_from_this<WebSocketSession> {
 public:
  using MakeDialogue = std::function<std::unique_ptr<Dialogue>(Connection)>;

  /// `make`: called when the connection is open.
  WebSocketSession(AnyStream stream, Shared& shared, Place place, std::string subprotocol, MakeDialogue make)
      : socket_(std::move(stream)),
        shared_(shared),
        place_(std::move(place)),
        subprotocol_(std::move(subprotocol)),
        make_(std::move(make)) {}

  ~WebSocketSession() { shared_.sockets.erase(this); }
  WebSocketSession(const WebSocketSession&) = delete;
  WebSocketSession& operator=(const WebSocketSession&) = delete;

  void start(const http::request<http::string_body>& request) {
    lowest().expires_never();
    socket_.set_option(websocket::stream_base::timeout{shared_.timeout, shared_.timeout, true});
    socket_.set_option(websocket::stream_base::decorator([name = subprotocol_](websocket::response_type& response) {
      response.set(http::field::sec_websocket_protocol, name);
    }));
    socket_.read_message_max(kMaxClientMessage_bytes);
    socket_.auto_fragment(false);
    socket_.control_callback([this](websocket::frame_type, beast::string_view) { note_message(); });
    lowest().socket().set_option(tcp::no_delay(true), ignored_);
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (!error) self->begin();
    });
  }

  void note_time(Timestamp now) {
    if (!closed_) dialogue_->note_time(now);
  }

  /// Cuts a client that does not read.
  void check(Timestamp now) {
    if (sending_ && now - sending_since_ > shared_.timeout) cut("slow");
  }

 private:
  AnyStream::Tcp& lowest() { return beast::get_lowest_layer(socket_); }

  void begin() {
    shared_.sockets.insert(this);
    dialogue_ = make_({.wake = [this] { send_next(); },
                       .cut = [this](const std::string& reason) { cut(reason); },
                       .note_refused = [this](const std::string& why) { shared_.site.note_refused(why); },
                       .hold = [this] { return shared_from_this(); },
                       .topics_changed = [shared = &shared_] { shared->topics_changed(); }});
    note_time(host_now());
    send_next();
    receive();
  }

  void receive() {
    socket_.async_read(received_, [self = shared_from_this()](error_code error, std::size_t /*bytes*/) {
      if (error) return self->close();
      self->take();
    });
  }

  void take() {
    const std::string message = beast::buffers_to_string(received_.data());
    received_.consume(received_.size());
    if (!note_message()) return;
    dialogue_->take(message, socket_.got_text());
    if (!closed_) receive();
  }

  // Counts a message of the client, or a ping; cuts a client that floods. A page draws at most 240 times a second.
  bool note_message() {
    if (messages_.take(host_now())) return true;
    cut("flood");
    return false;
  }

  void send_next() {
    if (sending_ || closed_ || !dialogue_) return;
    auto message = dialogue_->next();
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
  std::string subprotocol_;
  MakeDialogue make_;
  std::unique_ptr<Dialogue> dialogue_;
  beast::flat_buffer received_{kMaxClientMessage_bytes};
  TokenBucket messages_{300.0, 600.0};
  error_code ignored_;
  bool sending_ = false;
  bool closed_ = false;
  Timestamp sending_since_;
};

}  // namespace mocap::web
