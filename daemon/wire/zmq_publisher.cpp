#include "wire/zmq_publisher.h"

#include <fmt/core.h>
#include <zmq.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <optional>
#include <vector>

#include "base/log.h"
#include "wire/encode.h"
#include "wire/endpoint.h"

namespace mocap::wire {
namespace {

constexpr const char* kWho = "feed";
constexpr int kLinger_ms = 100;           // the last message goes out; the end of the service does not wait for more
constexpr int kMaxIncoming_bytes = 4096;  // a subscription is a topic; who sends more is cut off
constexpr int kHandshake_ms = 2000;       // half-open connections end
constexpr int kHeartbeat_ms = 1000;       // dead peers are noticed
// How many subscriptions are worked off a call: a flood of them cannot hold the feed up.
constexpr int kServedPerSnapshot = 64;
constexpr int kServedPerReport = 4096;

// Topic, zero byte, Protobuf. Grows to the largest message, then allocates no more.
class Envelope {
 public:
  explicit Envelope(const char* topic) : head_(std::strlen(topic) + 1), bytes_(topic, topic + head_) {}

  void hold(const google::protobuf::MessageLite& message) {
    const std::size_t size = message.ByteSizeLong();
    // With room to spare: the numbers that count up take more bytes from time to time.
    if (head_ + size > bytes_.capacity()) bytes_.reserve(std::bit_ceil(head_ + size + 64));
    bytes_.resize(head_ + size);
    message.SerializeWithCachedSizesToArray(bytes_.data() + head_);
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::size_t head_;
  std::vector<std::uint8_t> bytes_;
};

Error last_error(const std::string& what) {
  const int code = zmq_errno();
  switch (code) {
    case EADDRINUSE:
      return {ErrorCode::Busy,
              what + ": another program listens there (another mocapd?); end it or take another endpoint"};
    case EADDRNOTAVAIL:
    case ENODEV: return {ErrorCode::NotFound, what + ": this machine has no such address"};
    case EINVAL:
    case EPROTONOSUPPORT: return {ErrorCode::InvalidArgument, what + ": " + zmq_strerror(code)};
    default: return {ErrorCode::Io, what + ": " + zmq_strerror(code)};
  }
}

}  // namespace

struct ZmqPublisher::Impl {
  void* context = zmq_ctx_new();
  void* socket = nullptr;
  std::string endpoint;
  v1::Snapshot snapshot;
  v1::Health health;
  Envelope snapshot_envelope{kSnapshotTopic};
  Envelope description_envelope{kDescriptionTopic};
  Envelope health_envelope{kHealthTopic};
  std::uint64_t sequence = 0;
  std::int64_t utc_minus_host_ns = utc_minus_host().count();
  std::optional<Description> described;
  bool velocities = false;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (socket != nullptr) zmq_close(socket);
    if (context != nullptr) zmq_ctx_term(context);
  }

  Status set(int option, int value, const char* name) {
    if (zmq_setsockopt(socket, option, &value, sizeof(value)) == 0) return {};
    return last_error(fmt::format("{}: cannot set {} to {}", endpoint, name, value));
  }

  Status listen(const PublisherSettings& settings) {
    velocities = settings.velocities;
    endpoint = settings.endpoint;
    if (context != nullptr) socket = zmq_socket(context, ZMQ_XPUB);
    if (socket == nullptr) return last_error(endpoint + ": no ZeroMQ socket");
    const struct {
      int option, value;
      const char* name;
    } options[] = {{ZMQ_SNDHWM, settings.send_queue, "ZMQ_SNDHWM"},
                   {ZMQ_LINGER, kLinger_ms, "ZMQ_LINGER"},
                   {ZMQ_HANDSHAKE_IVL, kHandshake_ms, "ZMQ_HANDSHAKE_IVL"},
                   {ZMQ_HEARTBEAT_IVL, kHeartbeat_ms, "ZMQ_HEARTBEAT_IVL"},
                   {ZMQ_IPV6, endpoint.starts_with("tcp://[") ? 1 : 0, "ZMQ_IPV6"}};
    for (const auto& [option, value, name] : options) {
      if (Status done = set(option, value, name); !done) return done;
    }
    const std::int64_t max_incoming = kMaxIncoming_bytes;
    if (zmq_setsockopt(socket, ZMQ_MAXMSGSIZE, &max_incoming, sizeof(max_incoming)) != 0) {
      return last_error(endpoint + ": cannot set ZMQ_MAXMSGSIZE");
    }
    if (zmq_bind(socket, endpoint.c_str()) != 0) return last_error(fmt::format("endpoint '{}'", endpoint));
    char bound[512] = {};
    std::size_t size = sizeof(bound);
    if (zmq_getsockopt(socket, ZMQ_LAST_ENDPOINT, bound, &size) == 0) endpoint = bound;
    return {};
  }

  // What clients can tell for themselves by the description is left out.
  Parts parts_of(const Snapshot& from) const {
    Parts parts;
    parts.local_positions = !described || !stands_at_rest_offsets(from, *described);
    parts.velocities = velocities;
    return parts;
  }

  // Takes in what listeners ask for. Without it ZeroMQ delivers neither welcome nor anything else.
  void serve(int at_most) {
    zmq_msg_t message;
    zmq_msg_init(&message);
    while (at_most-- > 0 && zmq_msg_recv(&message, socket, ZMQ_DONTWAIT) >= 0) {
    }
    zmq_msg_close(&message);
  }

  Status send(const Envelope& envelope) {
    const auto& bytes = envelope.bytes();
    if (zmq_send(socket, bytes.data(), bytes.size(), ZMQ_DONTWAIT) >= 0) return {};
    return last_error(endpoint + ": cannot send");
  }
};

ZmqPublisher::ZmqPublisher(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ZmqPublisher::~ZmqPublisher() = default;

const std::string& ZmqPublisher::endpoint() const { return impl_->endpoint; }

Result<std::unique_ptr<ZmqPublisher>> ZmqPublisher::open(const PublisherSettings& settings) {
  if (settings.send_queue < 1 || settings.send_queue > 1000) {
    return Error{ErrorCode::InvalidArgument, fmt::format("send_queue is {}, expected 1 to 1000", settings.send_queue)};
  }
  if (const Status allowed = check_endpoint(settings.endpoint, settings.allow_remote); !allowed) return allowed.error();
  if (is_taken_ipc(settings.endpoint)) {
    errno = EADDRINUSE;
    return last_error(fmt::format("endpoint '{}'", settings.endpoint));
  }
  auto impl = std::make_unique<Impl>();
  if (const Status listening = impl->listen(settings); !listening) return listening.error();
  log_info(kWho, fmt::format("listening endpoint={} send_queue={}", impl->endpoint, settings.send_queue));
  if (!is_local(settings.endpoint)) {
    log_warn(kWho,
             fmt::format("endpoint={} is open to other machines and nobody is asked who they are", impl->endpoint));
  }
  return std::unique_ptr<ZmqPublisher>(new ZmqPublisher(std::move(impl)));
}

Status ZmqPublisher::describe(const Description& description) {
  impl_->description_envelope.hold(encode(description));
  impl_->described = description;
  const auto& bytes = impl_->description_envelope.bytes();
  if (zmq_setsockopt(impl_->socket, ZMQ_XPUB_WELCOME_MSG, bytes.data(), bytes.size()) != 0) {
    return last_error(impl_->endpoint + ": cannot set the welcome message");
  }
  impl_->serve(kServedPerSnapshot);
  return impl_->send(impl_->description_envelope);
}

Status ZmqPublisher::publish(Snapshot& snapshot) {
  impl_->serve(kServedPerSnapshot);
  Instants& instants = snapshot.instants;
  if (instants.received_at && instants.detected_at && instants.fused_at) instants.sent_at = host_now();
  encode(snapshot, impl_->snapshot, impl_->parts_of(snapshot));
  impl_->snapshot.set_sequence(impl_->sequence++);
  impl_->snapshot.set_utc_minus_host_ns(impl_->utc_minus_host_ns);
  impl_->snapshot_envelope.hold(impl_->snapshot);
  return impl_->send(impl_->snapshot_envelope);
}

Status ZmqPublisher::report(const Health& health) {
  impl_->utc_minus_host_ns = utc_minus_host().count();
  impl_->serve(kServedPerReport);
  encode(health, impl_->health);
  impl_->health.set_utc_minus_host_ns(impl_->utc_minus_host_ns);
  impl_->health_envelope.hold(impl_->health);
  if (impl_->described) {
    if (Status sent = impl_->send(impl_->description_envelope); !sent) return sent;
  }
  return impl_->send(impl_->health_envelope);
}

Result<std::unique_ptr<Publisher>> make_zmq_publisher(const PublisherSettings& settings) {
  Result<std::unique_ptr<ZmqPublisher>> opened = ZmqPublisher::open(settings);
  if (!opened) return opened.error();
  return std::unique_ptr<Publisher>(std::move(*opened));
}

}  // namespace mocap::wire
