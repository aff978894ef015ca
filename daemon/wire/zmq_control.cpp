#include "wire/zmq_control.h"

#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>
#include <zmq.h>

#include <charconv>
#include <optional>

#include "base/log.h"
#include "wire/control_codec.h"
#include "wire/listener.h"

namespace mocap::wire {
namespace {

constexpr const char* kWho = "control";
constexpr int kMaxIncoming_bytes = 65536;  // a fit of all bones and markers has 6 kB
constexpr int kSendQueue = 16;             // answers that wait for one client; half of it may be asked ahead
constexpr int kMaxConnections = 200;
constexpr std::size_t kMostFrames = 4;  // who, perhaps REQ's empty one, the request
constexpr Duration kLongestWait = std::chrono::milliseconds(50);

long whole_ms(Duration span) { return std::chrono::ceil<std::chrono::milliseconds>(span).count(); }

}  // namespace

std::string control_beside(const std::string& feed_endpoint) {
  if (feed_endpoint.starts_with("ipc://")) return feed_endpoint + ".control";
  const auto colon = feed_endpoint.rfind(':');
  const std::string port = feed_endpoint.substr(colon + 1);
  unsigned number = 0;
  const auto [end, fault] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (colon == std::string::npos || fault != std::errc{} || number == 0) return feed_endpoint;  // "*": any other port
  return feed_endpoint.substr(0, colon + 1) + std::to_string(number == 65535 ? number - 1 : number + 1);
}

struct ZmqControl::Impl {
  Listener listener{kWho};
  Role role_without_keys = Role::Operator;
  std::vector<std::string> route;  // the frames before the request
  std::uint64_t id = 0;
  Role role = Role::Viewer;
  v1::Request request;
  std::string bytes;

  void wait(Duration patience) {
    zmq_pollitem_t items[2] = {{listener.socket().get(), 0, ZMQ_POLLIN, 0},
                               {listener.asking_socket(), 0, ZMQ_POLLIN, 0}};
    zmq_poll(items, items[1].socket == nullptr ? 1 : 2, whole_ms(patience));
  }

  // The next message's frames: its route, and its last one. False: none is there, or it is none of ours.
  enum class Came { Nothing, Junk, Request };
  Came receive() {
    ZmqMessage part;
    if (!part.receive(listener.socket())) {
      listener.heard_all();
      return Came::Nothing;
    }
    route.clear();
    bytes.clear();
    std::size_t frames = 1;
    route.emplace_back(part.bytes());
    while (part.has_more()) {
      if (!part.receive(listener.socket())) return Came::Junk;
      if (++frames > kMostFrames) continue;
      note_sender(part);
      if (part.has_more()) {
        route.emplace_back(part.bytes());
      } else {
        bytes = part.bytes();
      }
    }
    return frames == 1 || frames > kMostFrames ? Came::Junk : Came::Request;
  }

  void note_sender(const ZmqMessage& part) {
    const Gatekeeper* keeper = listener.gatekeeper();
    role = keeper == nullptr ? role_without_keys : keeper->role_of(part.user()).value_or(Role::Viewer);
    if (!listener.gone().contains(part.connection())) listener.note_user(part.connection(), part.user());
  }

  void send(v1::Answer& answer) {
    answer.set_id(id);
    if (answer.has_status()) answer.mutable_status()->set_role(name_of(role));
    listener.socket().catch_up();
    for (const std::string& frame : route) {
      if (zmq_send(listener.socket().get(), frame.data(), frame.size(), ZMQ_DONTWAIT | ZMQ_SNDMORE) < 0) return;
    }
    const std::string out = answer.SerializeAsString();
    zmq_send(listener.socket().get(), out.data(), out.size(), ZMQ_DONTWAIT);
  }

  void refuse(v1::Code code, const std::string& why) {
    v1::Answer answer;
    answer.set_code(code);
    answer.set_message(why);
    send(answer);
  }

  // What came, if it is good and allowed; else its sender has the answer.
  std::optional<ControlRequest> read() {
    id = 0;
    request.Clear();
    if (!request.ParseFromString(bytes)) {
      refuse(v1::CODE_INVALID, "not a request of mocap.v1 in Protobuf");
      return std::nullopt;
    }
    id = request.id();
    Result<ControlRequest> wanted = decode(request);
    if (!wanted) {
      refuse(v1::CODE_INVALID, wanted.error().message);
      return std::nullopt;
    }
    if (role == Role::Viewer && !only_looks(wanted->action)) {
      refuse(v1::CODE_FORBIDDEN, "this needs the role operator; mocapctl keys allow --role operator gives it to a key");
      return std::nullopt;
    }
    return *std::move(wanted);
  }
};

ZmqControl::ZmqControl(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ZmqControl::~ZmqControl() = default;

const std::string& ZmqControl::endpoint() const { return impl_->listener.endpoints().front(); }

Result<std::unique_ptr<ZmqControl>> ZmqControl::open(const ControlSettings& settings) {
  // What strangers send and cannot be read is answered; Protobuf would write each such message to standard error, too.
  google::protobuf::SetLogHandler(nullptr);
  auto impl = std::make_unique<Impl>();
  impl->role_without_keys = settings.role_without_keys;
  ListenSettings listen;
  listen.endpoints = {settings.endpoint};
  listen.endpoints.insert(listen.endpoints.end(), settings.more_endpoints.begin(), settings.more_endpoints.end());
  listen.allow_remote = settings.allow_remote;
  listen.curve = settings.curve;
  listen.max_incoming_bytes = kMaxIncoming_bytes;
  listen.max_connections = kMaxConnections;
  if (const Status listening = impl->listener.open(ZMQ_ROUTER, kSendQueue, listen); !listening) {
    return listening.error();
  }
  return std::unique_ptr<ZmqControl>(new ZmqControl(std::move(impl)));
}

std::optional<ControlRequest> ZmqControl::next(Duration patience) {
  const Timestamp until = host_now() + patience;
  for (;;) {
    impl_->listener.serve(host_now());
    const Impl::Came came = impl_->receive();
    if (came == Impl::Came::Request) {
      if (std::optional<ControlRequest> wanted = impl_->read()) return wanted;
    }
    const Duration left = until - host_now();
    if (left <= Duration::zero()) return std::nullopt;
    if (came == Impl::Came::Nothing) impl_->wait(std::min(left, kLongestWait));
  }
}

void ZmqControl::answer(const ControlAnswer& answer) {
  v1::Answer out = encode(answer);
  impl_->send(out);
}

struct ControlClient::Impl {
  ZmqContext context;
  ZmqSocket socket;
};

ControlClient::ControlClient(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ControlClient::~ControlClient() = default;

Result<std::unique_ptr<ControlClient>> ControlClient::open(const Settings& settings) {
  auto impl = std::make_unique<Impl>();
  ZmqSocket& socket = impl->socket;
  if (Status opened = socket.open(impl->context, ZMQ_DEALER, settings.endpoint); !opened) return opened.error();
  static_cast<void>(socket.set(ZMQ_LINGER, 0));
  if (settings.endpoint.starts_with("tcp://[")) static_cast<void>(socket.set(ZMQ_IPV6, 1));
  if (!settings.server_key.empty()) {
    const std::pair<int, const std::string*> keys[] = {{ZMQ_CURVE_SERVERKEY, &settings.server_key},
                                                       {ZMQ_CURVE_PUBLICKEY, &settings.own_key.public_key},
                                                       {ZMQ_CURVE_SECRETKEY, &settings.own_key.secret_key}};
    for (const auto& [option, key] : keys) {
      if (Status set = socket.set(option, std::string_view(*key)); !set) return set.error();
    }
  }
  if (zmq_connect(socket.get(), settings.endpoint.c_str()) != 0) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("endpoint '{}': expected tcp://ADDRESS:PORT or ipc://PATH", settings.endpoint)};
  }
  return std::unique_ptr<ControlClient>(new ControlClient(std::move(impl)));
}

Result<std::string> ControlClient::ask(const std::string& request, Duration patience) {
  if (zmq_send(impl_->socket.get(), request.data(), request.size(), ZMQ_DONTWAIT) < 0) {
    return zmq_failure(impl_->socket.who());
  }
  zmq_pollitem_t item{impl_->socket.get(), 0, ZMQ_POLLIN, 0};
  ZmqMessage answer;
  if (zmq_poll(&item, 1, whole_ms(patience)) > 0 && answer.receive(impl_->socket)) return std::string(answer.bytes());
  return Error{
      ErrorCode::Timeout,
      fmt::format("{}: no answer within {:.1f} s; does mocapd run, with [control] at this endpoint, and is this "
                  "key allowed?",
                  impl_->socket.who(), to_s(patience))};
}

}  // namespace mocap::wire
