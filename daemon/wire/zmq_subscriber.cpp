#include "wire/zmq_subscriber.h"

#include <fmt/core.h>
#include <zmq.h>

#include <algorithm>
#include <cerrno>
#include <chrono>

#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace {

constexpr int kReconnect_ms = 100;       // delay before the first new attempt; doubles up to the maximum
constexpr int kMaxReconnect_ms = 1000;   // maximum of this delay
constexpr int kFeedHeartbeat_ms = 1000;  // period of heartbeats, which detect a dead host
constexpr int kFeedHandshake_ms = 2000;  // a peer that does not answer the handshake is not a feed

// The prefix of the messages of a topic.
std::string prefix_of(const std::string& topic) {
  if (topic.ends_with("/*")) return topic.substr(0, topic.size() - 1);
  return topic + '\0';
}

}  // namespace

struct ZmqSubscriber::Impl {
  ZmqContext context;
  ZmqSocket socket;
  SubscriberSettings settings;
  ClientLink link;

  Status connect() {
    const std::string& endpoint = settings.endpoint;
    link.close();
    socket.close();
    if (Status opened = socket.open(context, ZMQ_SUB, endpoint); !opened) return opened;
    const struct {
      int option, value;
    } options[] = {{ZMQ_RCVHWM, settings.receive_queue},
                   {ZMQ_LINGER, 0},
                   {ZMQ_RECONNECT_IVL, kReconnect_ms},
                   {ZMQ_RECONNECT_IVL_MAX, kMaxReconnect_ms},
                   {ZMQ_HANDSHAKE_IVL, kFeedHandshake_ms},
                   {ZMQ_HEARTBEAT_IVL, kFeedHeartbeat_ms},
                   {ZMQ_IPV6, endpoint.starts_with("tcp://[") ? 1 : 0}};
    for (const auto& [option, value] : options) {
      if (Status set = socket.set(option, value); !set) return set;
    }
    if (Status set = set_keys(socket, settings.keys); !set) return set;
    for (const std::string& topic : settings.topics) {
      if (Status set = socket.set(ZMQ_SUBSCRIBE, prefix_of(topic)); !set) return set;
    }
    link.watch(context.get(), socket.get(), settings.keys.on());
    if (zmq_connect(socket.get(), endpoint.c_str()) != 0) {
      return zmq_failure(fmt::format("endpoint '{}': expected tcp://ADDRESS:PORT or ipc://PATH", endpoint));
    }
    return {};
  }
};

ZmqSubscriber::ZmqSubscriber(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ZmqSubscriber::~ZmqSubscriber() = default;

Status ZmqSubscriber::subscribe(std::vector<std::string> topics) {
  const auto change = [&](int option, const std::vector<std::string>& from,
                          const std::vector<std::string>& without) -> Status {
    for (const std::string& topic : from) {
      if (std::ranges::find(without, topic) != without.end()) continue;
      if (Status set = impl_->socket.set(option, prefix_of(topic)); !set) return set;
    }
    return {};
  };
  if (Status added = change(ZMQ_SUBSCRIBE, topics, impl_->settings.topics); !added) return added;
  if (Status removed = change(ZMQ_UNSUBSCRIBE, impl_->settings.topics, topics); !removed) return removed;
  impl_->settings.topics = std::move(topics);
  return {};
}

const LinkStatus& ZmqSubscriber::link() const { return impl_->link.status(); }

Result<std::unique_ptr<ZmqSubscriber>> ZmqSubscriber::open(const SubscriberSettings& settings) {
  auto impl = std::make_unique<Impl>();
  impl->settings = settings;
  if (const Status connecting = impl->connect(); !connecting) return connecting.error();
  return std::unique_ptr<ZmqSubscriber>(new ZmqSubscriber(std::move(impl)));
}

Result<FeedMessage> ZmqSubscriber::next(Duration patience) {
  impl_->link.read();
  if (impl_->link.gave_up(host_now())) {
    if (const Status connecting = impl_->connect(); !connecting) return connecting.error();
  }
  ZmqMessage message;
  if (!message.receive(impl_->socket)) {
    zmq_pollitem_t item{impl_->socket.get(), 0, ZMQ_POLLIN, 0};
    const auto patience_ms = std::chrono::ceil<std::chrono::milliseconds>(patience).count();
    zmq_poll(&item, 1, static_cast<long>(patience_ms));
    impl_->link.read();
    if (!message.receive(impl_->socket)) {
      if (zmq_errno() == EAGAIN || zmq_errno() == EINTR) return Error{ErrorCode::Timeout, ""};
      return zmq_failure(impl_->settings.endpoint);
    }
  }
  const std::string_view bytes = message.bytes();
  const auto end = bytes.find('\0');
  if (end == std::string_view::npos) {
    return Error{ErrorCode::InvalidArgument,
                 impl_->settings.endpoint + ": a message without a topic; is this a mocapd feed?"};
  }
  return FeedMessage{std::string(bytes.substr(0, end)), std::string(bytes.substr(end + 1))};
}

}  // namespace mocap::wire
