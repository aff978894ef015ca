#include "bridges/relay/nats_link.h"

#include <fmt/format.h>
#include <nats/nats.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace mocap::relay {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kConnect_ms = 3000;
constexpr auto kRetryAfter = std::chrono::seconds(1);
constexpr int kPing_ms = 5000;  // a server that does not answer to two of these pings is gone
constexpr int kPingsOut = 2;
constexpr int kWriteDeadline_ms = 1000;
constexpr int kFlush_ms = 1000;
constexpr auto kBetweenFlushes = std::chrono::milliseconds(100);
constexpr auto kBehind = std::chrono::milliseconds(500);
constexpr auto kLastCallbacks = std::chrono::seconds(10);  // normally less than 1 ms: none of the callbacks waits

struct FreeConnection {
  void operator()(natsConnection* connection) const { natsConnection_Destroy(connection); }
};
struct FreeOptions {
  void operator()(natsOptions* options) const { natsOptions_Destroy(options); }
};
using Connection = std::unique_ptr<natsConnection, FreeConnection>;
using Options = std::unique_ptr<natsOptions, FreeOptions>;

std::string last_error() {
  const char* text = nats_GetLastError(nullptr);
  return text != nullptr ? text : "";
}

Error failed(std::string_view what) {
  return Error{ErrorCode::InvalidArgument, fmt::format("{}: {}", what, last_error())};
}

Status set_credentials(natsOptions* options, const Credentials& credentials) {
  natsStatus set = NATS_OK;
  if (!credentials.jwt.empty()) {
    set = natsOptions_SetUserCredentialsFromFiles(options, credentials.jwt.c_str(), nullptr);
  } else if (!credentials.token.empty()) {
    set = natsOptions_SetToken(options, credentials.token.c_str());
  } else if (!credentials.user.empty()) {
    set = natsOptions_SetUserInfo(options, credentials.user.c_str(), credentials.password.c_str());
  }
  return set == NATS_OK ? Status{} : Status{failed("--credentials")};
}

Status set_tls(natsOptions* options, const NatsSettings& settings) {
  std::string host = settings.server.host;
  if (host.starts_with('[')) host = host.substr(1, host.size() - 2);
  if (!settings.ca.empty() && natsOptions_LoadCATrustedCertificates(options, settings.ca.c_str()) != NATS_OK) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("--ca {}: cannot be read as certificates in PEM format", settings.ca.string())};
  }
  // The name is checked also if the server asks for TLS by itself.
  if (natsOptions_SetExpectedHostname(options, host.c_str()) != NATS_OK) return failed("--server");
  if (natsOptions_SetSecure(options, settings.server.tls) != NATS_OK) return failed("--server");
  return {};
}

}  // namespace

std::string explain_nats(int status, std::string_view text, const Server& server) {
  switch (status) {
    case NATS_SSL_ERROR:
      return fmt::format(
          "{} does not show a certificate for '{}' that --ca or the system trusts ({}): give the file of its authority "
          "with --ca",
          server.url(), server.host, text);
    case NATS_SECURE_CONNECTION_WANTED: [[fallthrough]];
    case NATS_SECURE_CONNECTION_REQUIRED:
      return fmt::format("{} has no TLS: give the server a certificate and a key, see its option --tls", server.url());
    case NATS_NOT_PERMITTED:
      return fmt::format("{} does not permit this user to publish: allow it mocap.>", server.url());
    case NATS_CONNECTION_AUTH_FAILED:
      return fmt::format("{} refuses the credentials: compare the file of --credentials with the users of the server",
                         server.url());
    case NATS_NO_SERVER:
      return fmt::format("no NATS server answers at {}: start it, or compare address and port with --server",
                         server.url());
    default: return fmt::format("{}: {}", server.url(), text);
  }
}

struct NatsLink::Impl {
  NatsSettings settings;
  Options options;
  mutable std::mutex mutex;
  std::condition_variable_any wake;
  NatsState state;
  std::uint64_t ended = 0;         // of state.connections; the callbacks of these are over
  Connection connection;           // replaced by the thread, under the mutex
  Clock::time_point ping_began{};  // of the ping without an answer; 0: there is none
  std::atomic<bool> sent_since_ping = false;
  std::jthread thread;  // the last member

  bool alive() const { return connection && natsConnection_Status(connection.get()) == NATS_CONN_STATUS_CONNECTED; }

  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (!state.connected) {
        connect();
      } else if (!natsConnection_IsClosed(connection.get())) {
        ping(stop);
      } else {
        disconnect(NATS_NO_SERVER, "");
      }
      std::unique_lock lock(mutex);
      wake.wait_for(lock, stop, state.connected ? Clock::duration(kBetweenFlushes) : kRetryAfter, [] { return false; });
    }
  }

  // The library calls it in a thread of its own: the server refused a message.
  static void note_refusal(natsConnection* /*connection*/, natsSubscription* /*subscription*/, natsStatus status,
                           void* of) {
    Impl& impl = *static_cast<Impl*>(of);
    const std::scoped_lock lock(impl.mutex);
    if (status == NATS_NOT_PERMITTED) impl.state.reason = explain_nats(status, "", impl.settings.server);
  }

  // The library calls it once for each connection that was made, after the last note_refusal() of that connection.
  static void note_closed(natsConnection* /*connection*/, void* of) {
    Impl& impl = *static_cast<Impl*>(of);
    const std::scoped_lock lock(impl.mutex);
    ++impl.ended;
    impl.wake.notify_all();
  }

  // Closes the connection. The library may still have callbacks of it, and of those before, in its queue: returns
  // whether all of them are over.
  bool end() {
    thread.request_stop();
    thread.join();
    connection.reset();
    std::unique_lock lock(mutex);
    return wake.wait_for(lock, kLastCallbacks, [this] { return ended == state.connections; });
  }

  void connect() {
    natsConnection* made = nullptr;
    const natsStatus status = natsConnection_Connect(&made, options.get());
    Connection opened(made);
    const std::scoped_lock lock(mutex);
    if (status != NATS_OK) {
      state.reason = explain_nats(status, last_error(), settings.server);
      return;
    }
    connection = std::move(opened);
    state.connected = true;
    state.reason.clear();
    ++state.connections;
    ping_began = {};
  }

  void disconnect(natsStatus status, std::string_view text) {
    Connection closed;
    const std::scoped_lock lock(mutex);
    closed = std::move(connection);
    state.connected = false;
    state.reason = explain_nats(status, text, settings.server);
  }

  // Waits until the server has taken all that was sent before.
  void ping(const std::stop_token& stop) {
    if (!sent_since_ping.exchange(false)) return;
    {
      const std::scoped_lock lock(mutex);
      ping_began = Clock::now();
    }
    natsStatus status = NATS_TIMEOUT;
    while (status == NATS_TIMEOUT && !stop.stop_requested()) {
      status = natsConnection_FlushTimeout(connection.get(), kFlush_ms);
    }
    const std::scoped_lock lock(mutex);
    ping_began = {};
  }
};

NatsLink::NatsLink(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

NatsLink::~NatsLink() {
  // A callback that is still to come needs the Impl, which is then never freed.
  if (!impl_->end()) static_cast<void>(impl_.release());
}

Result<std::unique_ptr<NatsLink>> NatsLink::open(const NatsSettings& settings) {
  auto impl = std::make_unique<Impl>();
  impl->settings = settings;
  natsOptions* made = nullptr;
  if (natsOptions_Create(&made) != NATS_OK) return failed("NATS");
  impl->options.reset(made);
  const bool set = natsOptions_SetURL(made, settings.server.url().c_str()) == NATS_OK &&
                   natsOptions_SetName(made, "mocap-relay") == NATS_OK &&
                   natsOptions_SetTimeout(made, kConnect_ms) == NATS_OK &&
                   natsOptions_SetPingInterval(made, kPing_ms) == NATS_OK &&
                   natsOptions_SetMaxPingsOut(made, kPingsOut) == NATS_OK &&
                   natsOptions_SetWriteDeadline(made, kWriteDeadline_ms) == NATS_OK &&
                   natsOptions_SetSendAsap(made, true) == NATS_OK &&
                   natsOptions_SetErrorHandler(made, Impl::note_refusal, impl.get()) == NATS_OK &&
                   natsOptions_SetClosedCB(made, Impl::note_closed, impl.get()) == NATS_OK &&
                   // This class reconnects, because the library hides the reasons of failed attempts.
                   natsOptions_SetAllowReconnect(made, false) == NATS_OK &&
                   natsOptions_SetIgnoreDiscoveredServers(made, true) == NATS_OK;
  if (!set) return failed("--server");
  if (const Status tls = set_tls(made, settings); !tls) return tls.error();
  if (const Status known = set_credentials(made, settings.credentials); !known) return known.error();
  Impl& running = *impl;
  impl->thread = std::jthread([&running](const std::stop_token& stop) { running.run(stop); });
  return std::unique_ptr<NatsLink>(new NatsLink(std::move(impl)));
}

bool NatsLink::ready() const {
  const std::scoped_lock lock(impl_->mutex);
  if (!impl_->alive()) return false;
  return impl_->ping_began == Clock::time_point{} || Clock::now() - impl_->ping_began < kBehind;
}

bool NatsLink::publish(const std::string& subject, std::string_view payload) {
  const std::scoped_lock lock(impl_->mutex);
  if (!impl_->alive()) return false;
  impl_->sent_since_ping = true;
  return natsConnection_Publish(impl_->connection.get(), subject.c_str(), payload.data(),
                                static_cast<int>(payload.size())) == NATS_OK;
}

NatsState NatsLink::state() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->state;
}

}  // namespace mocap::relay
