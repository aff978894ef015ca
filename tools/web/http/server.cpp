#include "web/http/server.h"

#include <fmt/format.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "web/feed_reader.h"
#include "web/http/any_stream.h"
#include "web/site.h"
#include "web/token_bucket.h"

namespace mocap::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMaxHeader_bytes = 8 * 1024;
constexpr std::size_t kMaxBody_bytes = 64 * 1024;
constexpr std::size_t kMaxPageMessage_bytes = 64 * 1024;
constexpr std::size_t kMaxConnections = 128;
constexpr std::size_t kMaxConnectionsOfOne = 64;  // of one address
constexpr int kMaxRequestsInWork = 8;             // of one page
constexpr const char* kSubprotocol = "mocap.v1";
constexpr Duration kReadPatience = std::chrono::seconds(5);
constexpr Duration kChangePatience = std::chrono::seconds(35);  // a take ends when the disk has all of it
constexpr Duration kLinger = std::chrono::seconds(2);           // after the last reply of a connection
constexpr Duration kTick = std::chrono::milliseconds(200);
constexpr Duration kStatePeriod = std::chrono::seconds(1);

// The page loads only its own files, talks only to this server, and cannot be shown within another page.
constexpr const char* kContentPolicy =
    "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

std::string text_of(beast::string_view text) { return {text.data(), text.size()}; }

HttpRequest request_of(const http::request<http::string_body>& raw, const std::string& remote) {
  const auto header = [&](http::field name) { return text_of(raw[name]); };
  HttpRequest request;
  request.method = text_of(raw.method_string());
  const std::string target = text_of(raw.target());
  const std::size_t query = target.find('?');
  request.path = target.substr(0, query);
  if (query != std::string::npos) request.query = target.substr(query + 1);
  request.host = header(http::field::host);
  request.origin = header(http::field::origin);
  request.fetch_site = text_of(raw["Sec-Fetch-Site"]);
  request.content_type = header(http::field::content_type);
  request.authorization = header(http::field::authorization);
  request.cookie = header(http::field::cookie);
  request.accept_encoding = header(http::field::accept_encoding);
  request.if_none_match = header(http::field::if_none_match);
  request.body = raw.body();
  request.remote = remote;
  return request;
}

http::response<http::string_body> response_of(HttpReply&& reply, const http::request<http::string_body>& request) {
  http::response<http::string_body> response{static_cast<http::status>(reply.status), request.version()};
  response.set(http::field::content_type, reply.content_type);
  response.set("Content-Security-Policy", kContentPolicy);
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set(http::field::cache_control, "no-store");
  for (const auto& [name, value] : reply.headers) response.set(name, value);
  response.keep_alive(request.keep_alive());
  const std::size_t size = reply.body.size();
  if (request.method() != http::verb::head) response.body() = std::move(reply.body);
  response.prepare_payload();
  if (request.method() == http::verb::head) response.content_length(size);
  return response;
}

// The connections that are open, by address.
class Connections {
 public:
  // Returns whether one more connection of `address` is permitted, and counts it then.
  bool add(const std::string& address) {
    std::size_t& count = by_address_[address];
    if (total_ >= kMaxConnections || count >= kMaxConnectionsOfOne) return false;
    ++total_;
    ++count;
    return true;
  }
  void remove(const std::string& address) {
    --total_;
    if (--by_address_[address] == 0) by_address_.erase(address);
  }

 private:
  std::size_t total_ = 0;
  std::map<std::string, std::size_t> by_address_;
};

class PageSession;

// What all sessions use.
struct Shared {
  Site& site;
  Hub& hub;
  std::chrono::nanoseconds timeout;
  std::function<void()> topics_changed;
  Connections connections = {};
  std::set<PageSession*> pages = {};
};

// Counts its connection as long as it lives.
class Place {
 public:
  Place(Shared& shared, std::string address) : shared_(&shared), address_(std::move(address)) {}
  Place(Place&& other) noexcept : shared_(std::exchange(other.shared_, nullptr)), address_(std::move(other.address_)) {}
  Place& operator=(Place&&) = delete;
  ~Place() {
    if (shared_ != nullptr) shared_->connections.remove(address_);
  }

 private:
  Shared* shared_;
  std::string address_;
};

// The WebSocket of one page. Its handlers keep it alive.
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

  // Cuts a page that does not read.
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

// One HTTP connection, until it ends or becomes a WebSocket. Its handlers keep it alive.
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
    parser_->body_limit(kMaxBody_bytes);
    http::async_read(*stream_, received_, *parser_,
                     [self = shared_from_this()](error_code error, std::size_t /*bytes*/) { self->take(error); });
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
    if (request.path == "/ws") return open_page(request);
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
    if (error == http::error::body_limit) return send(refusal(413, "the body is too large, expected at most 64 KiB"));
    if (too_large) return send(refusal(431, "the header is too large, expected at most 8 KiB"));
    send(refusal(400, "malformed HTTP request"));
  }

  void open_page(const HttpRequest& request) {
    if (!websocket::is_upgrade(request_) || received_.size() > 0) {
      return send(refusal(426, "expected a WebSocket with the subprotocol mocap.v1"));
    }
    http::token_list offered(request_[http::field::sec_websocket_protocol]);
    if (!offered.exists(kSubprotocol)) return send(refusal(400, "Sec-WebSocket-Protocol: expected mocap.v1"));
    Result<Visitor, HttpReply> visitor = shared_.site.admit_page(request);
    if (!visitor) return send(HttpReply(visitor.error()));
    const auto page =
        std::make_shared<PageSession>(*std::move(stream_), shared_, std::move(place_), *std::move(visitor), remote_);
    stream_.reset();
    page->start(request_);
  }

  void send(HttpReply&& reply) {
    limit_time();
    response_.emplace(response_of(std::move(reply), request_));
    http::async_write(*stream_, *response_, [self = shared_from_this()](error_code error, std::size_t /*bytes*/) {
      if (error) return;
      if (self->response_->need_eof()) return self->end();
      self->receive();
    });
  }

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
  TokenBucket requests_{50.0, 200.0};
  std::array<char, 4096> discarded_{};
};

Status load_certificate(asio::ssl::context& tls, const ServerSettings& settings) {
  error_code error;
  tls.set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 |
                  asio::ssl::context::no_tlsv1_1 | SSL_OP_NO_RENEGOTIATION);
  tls.use_certificate_chain_file(settings.certificate, error);
  if (error) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("--certificate {}: {}; mocap-web cert makes one", settings.certificate, error.message())};
  }
  tls.use_private_key_file(settings.private_key, asio::ssl::context::pem, error);
  if (error) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("--private-key {}: {}; expected the key of the certificate as a PEM file",
                             settings.private_key, error.message())};
  }
  return {};
}

}  // namespace

// Order of the members: sessions, which the loop destroys, use the members above the loop; threads, which post to the
// loop, are below.
struct Server::Impl {
  explicit Impl(const ServerSettings& given)
      : settings(given), hub(given.feed, host_now()), accepts(given.accepts_hz, 2.0 * given.accepts_hz) {}

  ServerSettings settings;
  Hub hub;
  std::optional<asio::ssl::context> tls;
  std::optional<Site> site;
  std::optional<Shared> shared;
  asio::io_context loop{1};
  tcp::acceptor acceptor{loop};
  asio::steady_timer timer{loop};
  asio::signal_set signals{loop, SIGINT, SIGTERM};
  std::unique_ptr<ControlWorker> reads;
  std::unique_ptr<ControlWorker> changes;
  std::unique_ptr<FeedReader> feed;
  TokenBucket accepts;
  Timestamp state_said_at;
  bool was_connected = false;
  bool accepting = false;

  Status open_feed();
  Status open_port();
  void accept();
  void take(tcp::socket socket);
  void take_messages();
  void tick();
};

Status Server::Impl::open_feed() {
  const wire::ControlClient::Settings control{
      settings.control.empty() ? wire::control_beside(settings.feed) : settings.control, settings.keys};
  auto reader = ControlWorker::open(control, kReadPatience);
  if (!reader) return reader.error();
  reads = *std::move(reader);
  auto changer = ControlWorker::open(control, kChangePatience);
  if (!changer) return changer.error();
  changes = *std::move(changer);
  wire::SubscriberSettings subscriber{.endpoint = settings.feed, .topics = {}, .keys = settings.keys};
  const auto topics = hub.topics();
  subscriber.topics.assign(topics.begin(), topics.end());
  auto follower = FeedReader::open(subscriber, [this] { asio::post(loop, [this] { take_messages(); }); });
  if (!follower) return follower.error();
  feed = *std::move(follower);
  return {};
}

Status Server::Impl::open_port() {
  error_code error;
  const auto address = asio::ip::make_address(settings.listen, error);
  if (error) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("--listen is '{}', expected an address as 127.0.0.1 or ::", settings.listen)};
  }
  const tcp::endpoint place(address, settings.port);
  acceptor.open(place.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(place, error);
  if (!error) acceptor.listen(static_cast<int>(kMaxConnections), error);
  if (!error) return {};
  const bool busy = error == asio::error::address_in_use;
  return Error{busy ? ErrorCode::Busy : ErrorCode::Io,
               fmt::format("{} port {}: {}{}", settings.listen, settings.port, error.message(),
                           busy ? "; stop the other program, or choose another --port" : "")};
}

void Server::Impl::accept() {
  accepting = true;
  acceptor.async_accept([this](error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    accepting = !error;  // no file descriptor is free: tick() tries again
    if (error) return;
    take(std::move(socket));
    accept();
  });
}

void Server::Impl::take(tcp::socket socket) {
  error_code error;
  const tcp::endpoint remote = socket.remote_endpoint(error);
  if (error) return;
  const std::string address = remote.address().to_string();
  if (!accepts.take(host_now()) || !shared->connections.add(address)) return site->note_refused("connections");
  std::make_shared<HttpSession>(std::move(socket), tls ? &*tls : nullptr, *shared, Place(*shared, address),
                                fmt::format("{}:{}", address, remote.port()))
      ->start();
}

void Server::Impl::take_messages() {
  hub.note_link(feed->link());
  hub.take(feed->take(), host_now());
}

void Server::Impl::tick() {
  const Timestamp now = host_now();
  hub.note_link(feed->link());
  const bool connected = hub.status(now).connected;
  const bool due = now - state_said_at >= kStatePeriod || connected != was_connected;
  const std::set<PageSession*> pages = shared->pages;  // a page may leave
  for (PageSession* page : pages) {
    page->check(now);
    if (due) page->say_state(now);
  }
  if (due) state_said_at = now;
  if (!accepting) accept();
  was_connected = connected;
  timer.expires_after(kTick);
  timer.async_wait([this](error_code error) {
    if (!error) tick();
  });
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::~Server() {
  if (impl_->shared) impl_->shared->topics_changed = [] {};  // sessions end after the FeedReader
}

Status check_exposure(const ServerSettings& settings) {
  if (is_loopback(settings.listen)) return {};
  if (settings.certificate.empty()) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("--listen {}: other machines reach this address, so TLS is needed: mocap-web cert web, then "
                    "--certificate web.crt --private-key web.key",
                    settings.listen)};
  }
  if (settings.access.open) {
    return Error{ErrorCode::InvalidArgument, fmt::format("--listen {}: other machines reach this address, so tokens "
                                                         "are needed: mocap-web token web.tokens NAME, then "
                                                         "--tokens web.tokens",
                                                         settings.listen)};
  }
  return {};
}

Result<std::unique_ptr<Server>> Server::open(const ServerSettings& settings) {
  if (Status exposure = check_exposure(settings); !exposure) return exposure.error();
  auto impl = std::make_unique<Impl>(settings);
  if (!settings.certificate.empty()) {
    impl->tls.emplace(asio::ssl::context::tls_server);
    if (Status loaded = load_certificate(*impl->tls, settings); !loaded) return loaded.error();
  }
  if (Status opened = impl->open_port(); !opened) return opened.error();
  if (Status opened = impl->open_feed(); !opened) return opened.error();
  Impl& parts = *impl;
  parts.site.emplace(settings.access,
                     Site::Parts{parts.hub, *parts.reads, *parts.changes,
                                 [&parts](std::function<void()> work) { asio::post(parts.loop, std::move(work)); }});
  parts.shared.emplace(
      Shared{*parts.site, parts.hub, from_s(settings.timeout_s), [&parts] { parts.feed->want(parts.hub.topics()); }});
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

std::string Server::address() const {
  const tcp::endpoint place = impl_->acceptor.local_endpoint();
  const std::string host = place.address().to_string();
  return fmt::format("{}://{}:{}", impl_->tls ? "https" : "http", place.address().is_v6() ? '[' + host + ']' : host,
                     place.port());
}

bool Server::waits_for_daemon() const { return impl_->reads->is_busy() || impl_->changes->is_busy(); }

void Server::run() {
  impl_->signals.async_wait([this](error_code, int) { impl_->loop.stop(); });
  impl_->tick();
  impl_->loop.run();
}

}  // namespace mocap::web
