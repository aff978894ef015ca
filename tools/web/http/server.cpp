#include "web/http/server.h"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <optional>
#include <set>
#include <utility>

#include "web/feed/feed_reader.h"
#include "web/http/any_stream.h"
#include "web/http/http_session.h"
#include "web/site.h"
#include "web/token_bucket.h"

namespace mocap::web {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(200);
constexpr Duration kStatePeriod = std::chrono::seconds(1);

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
  std::unique_ptr<ControlWorker> learning;
  std::unique_ptr<PreflightSite> preflight;
  std::unique_ptr<TakeSite> takes;
  std::unique_ptr<Worker> imports;
  std::unique_ptr<FeedReader> feed;
  TokenBucket accepts;
  Timestamp state_said_at;
  bool was_connected = false;
  bool accepting = false;

  RunHere run_here() {
    return [this](std::function<void()> work) { asio::post(loop, std::move(work)); };
  }
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
  for (auto* worker : {&reads, &changes, &learning}) {
    auto opened = ControlWorker::open(control);
    if (!opened) return opened.error();
    *worker = *std::move(opened);
  }
  auto checker = PreflightSite::open(control, run_here());
  if (!checker) return checker.error();
  preflight = *std::move(checker);
  takes = std::make_unique<TakeSite>(settings.takes, settings.feed, run_here());
  imports = std::make_unique<Worker>();
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
  const std::set<WebSocketSession*> sockets = shared->sockets;  // a client may leave
  for (WebSocketSession* socket : sockets) {
    socket->check(now);
    if (due) socket->note_time(now);
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
  parts.site.emplace(settings.access, Site::Parts{parts.hub, *parts.reads, *parts.changes, *parts.learning,
                                                  *parts.takes, *parts.preflight, *parts.imports, parts.run_here()});
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

bool Server::waits() const {
  return impl_->reads->is_busy() || impl_->changes->is_busy() || impl_->learning->is_busy() ||
         impl_->preflight->is_busy() || impl_->takes->is_busy() || impl_->imports->is_busy();
}

void Server::run() {
  impl_->signals.async_wait([this](error_code, int) { impl_->loop.stop(); });
  impl_->tick();
  impl_->loop.run();
  impl_->takes->stop_exports();
  impl_->site->stop_imports();
}

}  // namespace mocap::web
