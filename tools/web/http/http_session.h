#pragma once

#include <algorithm>
#include <array>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "web/foxglove/foxglove_dialogue.h"
#include "web/http/any_stream.h"
#include "web/http/messages.h"
#include "web/http/shared.h"
#include "web/http/websocket_session.h"
#include "web/page_dialogue.h"
#include "web/token_bucket.h"

namespace mocap::web {

inline constexpr std::size_t kMaxHeader_bytes = 8 * 1024;
inline constexpr std::size_t kMaxBody_bytes = 64 * 1024;
inline constexpr Duration kUploadPatience = std::chrono::seconds(120);  ///< for the body of an upload
inline constexpr Duration kLinger = std::chrono::seconds(2);            ///< after the last reply of a connection

/// One HTTP connection, until it ends or becomes a WebSocket. Its handlers keep it alive.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(tcp::socket socket, asio::ssl::context* tls, Shared& shared, Place place, std::string remote)
      : stream_(std::in_place, std::move(socket), tls),
        shared_(shared),
        place_(std::move(place)),
        remote_(std::move(remote)) {}

  void start() {
    if (!stream_->has_tls()) return receive();
    limit_time();
    stream_->handshake(AnyHandler([self = shared_from_this()](error_code error, std::size_t /*bytes*/) {
      if (!error) return self->receive();
      self->shared_.site.note_refused("handshake");
    }));
  }

 private:
  void limit_time() { stream_->next_layer().expires_after(shared_.timeout); }

  void receive() {
    limit_time();
    parser_.emplace();
    parser_->header_limit(kMaxHeader_bytes);
    parser_->body_limit(kMaxUpload_bytes);  // the parser compares it with Content-Length before the path is known
    http::async_read_header(
        *stream_, received_, *parser_,
        [self = shared_from_this()](error_code error, std::size_t /*bytes*/) { self->take_header(error); });
  }

  void take_header(error_code error) {
    if (error) return take(error);
    const HttpRequest head = request_of(parser_->get(), remote_);
    if (Site::is_upload(head)) return admit_upload(head);
    if (head.content_length > kMaxBody_bytes) return refuse(http::error::body_limit);
    parser_->body_limit(kMaxBody_bytes);
    http::async_read(*stream_, received_, *parser_,
                     [self = shared_from_this()](error_code read, std::size_t /*bytes*/) { self->take(read); });
  }

  // Before the body is read: it needs memory.
  void admit_upload(const HttpRequest& head) {
    Result<std::shared_ptr<void>, HttpReply> place = shared_.site.admit_upload(head);
    if (!place) {
      request_ = {};
      request_.version(11);
      request_.keep_alive(false);
      return send(HttpReply(place.error()));
    }
    upload_ = *std::move(place);
    upload_ends_ = host_now() + kUploadPatience;
    receive_upload();
  }

  void receive_upload() {
    if (parser_->is_done()) return take({});
    const Duration left = upload_ends_ - host_now();
    if (left <= Duration::zero()) return take(beast::error::timeout);
    stream_->next_layer().expires_after(std::min<Duration>(shared_.timeout, left));
    http::async_read_some(*stream_, received_, *parser_,
                          [self = shared_from_this()](error_code error, std::size_t /*bytes*/) {
                            error ? self->take(error) : self->receive_upload();
                          });
  }

  void take(error_code error) {
    if (error == http::error::end_of_stream) return;
    if (error) return refuse(error);
    request_ = parser_->release();
    HttpRequest request = request_of(request_, remote_);
    if (!requests_.take(host_now())) {
      shared_.site.note_refused("flood");
      request_.keep_alive(false);
      return send(refusal(429, "too many requests; at most 50 a second on average"));
    }
    if (websocket::is_upgrade(request_) && (request.path == "/ws" || request.path == "/")) return open_socket(request);
    if (request.path == "/ws") return send(refusal(426, "expected a WebSocket with the subprotocol mocap.v1"));
    shared_.site.answer(request, [self = shared_from_this()](HttpReply reply) { self->send(std::move(reply)); });
  }

  // Answers what can be answered; otherwise ends the connection.
  void refuse(error_code error) {
    const bool too_large =
        error == http::error::header_limit || error == http::error::body_limit || error == http::error::buffer_overflow;
    if (error == beast::error::timeout) return shared_.site.note_refused("timeout");
    if (error.category() != http::make_error_code(http::error::end_of_stream).category()) return;
    shared_.site.note_refused(too_large ? "size" : "malformed");
    request_ = {};
    request_.version(11);
    request_.keep_alive(false);
    if (error == http::error::body_limit)
      return send(refusal(413, "the body is too large, expected at most 64 KiB, for a C3D file 8 MiB"));
    if (too_large) return send(refusal(431, "the header is too large, expected at most 8 KiB"));
    send(refusal(400, "malformed HTTP request"));
  }

  // Opens the WebSocket that the client asks for: the first subprotocol of ours that it offers.
  void open_socket(const HttpRequest& request) {
    if (received_.size() > 0) return send(refusal(400, "expected no data before the answer to the handshake"));
    http::token_list offered(request_[http::field::sec_websocket_protocol]);
    if (offered.exists(kPageSubprotocol)) return open_page(request);
    for (const char* name : kFoxgloveSubprotocols) {
      if (offered.exists(name)) return open_foxglove(request, name);
    }
    send(refusal(400, "Sec-WebSocket-Protocol: expected mocap.v1, foxglove.sdk.v1 or foxglove.websocket.v1"));
  }

  void open_page(const HttpRequest& request) {
    Result<Visitor, HttpReply> visitor = shared_.site.admit_page(request);
    if (!visitor) return send(HttpReply(visitor.error()));
    start(kPageSubprotocol, [&shared = shared_, visitor = *visitor, remote = remote_](Connection connection) {
      return std::make_unique<PageDialogue>(shared.site, shared.hub, std::move(connection), visitor, remote);
    });
  }

  void open_foxglove(const HttpRequest& request, const char* subprotocol) {
    if (auto refused = shared_.site.refuse_reader(request)) return send(*std::move(refused));
    start(subprotocol, [&hub = shared_.hub](Connection connection) {
      return std::make_unique<FoxgloveDialogue>(hub, std::move(connection));
    });
  }

  void start(const char* subprotocol, WebSocketSession::MakeDialogue make) {
    const auto session = std::make_shared<WebSocketSession>(*std::move(stream_), shared_, std::move(place_),
                                                            subprotocol, std::move(make));
    stream_.reset();
    session->start(request_);
  }

  void send(HttpReply&& reply) {
    limit_time();
    upload_.reset();
    body_ = request_.method() == http::verb::head ? nullptr : reply.stream;
    response_.emplace(response_of(std::move(reply), request_));
    if (body_) return send_header();
    http::async_write(*stream_, *response_, [self = shared_from_this()](error_code error, std::size_t /*bytes*/) {
      if (!error) self->go_on();
    });
  }

  void go_on() {
    if (response_->need_eof()) return end();
    receive();
  }

  void send_header() {
    serializer_.emplace(*response_);
    http::async_write_header(*stream_, *serializer_,
                             [self = shared_from_this()](error_code error, std::size_t /*bytes*/) {
                               if (!error) self->send_piece(self->body_->size());
                             });
  }

  // `left`: bytes of the body that were not sent yet.
  void send_piece(std::uint64_t left) {
    if (left == 0) {
      body_.reset();
      return go_on();
    }
    body_->next([self = shared_from_this(), left](std::string piece) {
      if (piece.empty() || piece.size() > left) return self->close();  // the client sees that the body is too short
      self->limit_time();
      self->piece_ = std::move(piece);
      asio::async_write(*self->stream_, asio::buffer(self->piece_), [self, left](error_code error, std::size_t bytes) {
        if (!error) self->send_piece(left - bytes);
      });
    });
  }

  void close() { stream_->next_layer().close(); }

  void end() {
    error_code ignored;
    stream_->next_layer().socket().shutdown(tcp::socket::shutdown_send, ignored);
    stream_->next_layer().expires_after(kLinger);
    discard();
  }

  // Reads what the client still sends: closing a connection with unread data would discard the reply too.
  void discard() {
    stream_->async_read_some(asio::buffer(discarded_),
                             [self = shared_from_this()](error_code error, std::size_t /*bytes*/) {
                               if (!error) self->discard();
                             });
  }

  std::optional<AnyStream> stream_;
  Shared& shared_;
  Place place_;
  std::string remote_;
  beast::flat_buffer received_{kMaxHeader_bytes + kMaxBody_bytes};
  std::optional<http::request_parser<http::string_body>> parser_;
  http::request<http::string_body> request_;
  std::optional<http::response<http::string_body>> response_;
  std::optional<http::response_serializer<http::string_body>> serializer_;
  std::shared_ptr<ByteStream> body_;
  std::string piece_;
  std::shared_ptr<void> upload_;  // its place, until the answer
  Timestamp upload_ends_;
  TokenBucket requests_{50.0, 200.0};
  std::array<char, 4096> discarded_{};
};

}  // namespace mocap::web
