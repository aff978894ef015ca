#include "wire/zmq_control.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/stubs/logging.h>
#include <zmq.h>

#include <charconv>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/expects.h"
#include "base/log.h"
#include "wire/codec/control_codec.h"
#include "wire/listener.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace {

constexpr const char* kWho = "control";
constexpr int kMaxIncoming_bytes = 65536;  // the largest request, a fit of all bones and markers, has 6 kB
constexpr int kSendQueue = 16;             // answers that wait for one client; ZeroMQ frees them by halves of the queue
constexpr int kMaxConnections = 200;
constexpr std::size_t kLongestStated = 64;
constexpr std::size_t kMostFrames = 4;  // routing id, empty delimiter of a REQ client, request; one to spare

// The request's member of `what`: "take"; empty: none.
std::string order_name(const v1::Request& request) {
  const auto* what = v1::Request::descriptor()->FindOneofByName("what");
  const auto* member = request.GetReflection()->GetOneofFieldDescriptor(request, what);
  return member == nullptr ? std::string() : member->name();
}

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
  // To whom and how an answer is sent.
  struct Address {
    std::vector<std::string> route;  // frames before the request: routing id, and the delimiter of a REQ client
    std::uint64_t id = 0;            // the client's number of the request
    Role role = Role::Viewer;
  };

  Listener listener{kWho};
  Role role_without_keys = Role::Operator;
  Address last;                           // of the message that was received last
  std::map<std::uint64_t, Address> open;  // by the number of a request that is not answered yet
  std::uint64_t requests = 0;
  AuditTrail* audit = nullptr;
  AuditActor sender;
  v1::Request request;
  std::string bytes;

  void wait(Duration patience) {
    zmq_pollitem_t items[2] = {{listener.socket().get(), 0, ZMQ_POLLIN, 0},
                               {listener.asking_socket(), 0, ZMQ_POLLIN, 0}};
    zmq_poll(items, items[1].socket == nullptr ? 1 : 2, whole_ms(patience));
  }

  // Receives the next message: its last frame into `bytes`, the frames before into `last.route`. Malformed: the number
  // of frames is wrong.
  enum class Received { Nothing, Malformed, Request };
  Received receive() {
    ZmqMessage part;
    if (!part.receive(listener.socket())) {
      listener.heard_all();
      return Received::Nothing;
    }
    last.route.clear();
    bytes.clear();
    std::size_t frames = 1;
    last.route.emplace_back(part.bytes());
    while (part.has_more()) {
      if (!part.receive(listener.socket())) return Received::Malformed;
      if (++frames > kMostFrames) continue;
      note_sender(part);
      if (part.has_more()) {
        last.route.emplace_back(part.bytes());
      } else {
        bytes = part.bytes();
      }
    }
    return frames == 1 || frames > kMostFrames ? Received::Malformed : Received::Request;
  }

  void note_sender(const ZmqMessage& part) {
    const Gatekeeper* keeper = listener.gatekeeper();
    last.role = keeper == nullptr ? role_without_keys : keeper->role_of(part.user()).value_or(Role::Viewer);
    if (!listener.gone().contains(part.connection())) listener.note_user(part.connection(), part.user());
    sender = listener.actor_of(part.connection(), part.user());
    sender.role = name_of(last.role);
  }

  void send(const Address& to, v1::Answer& answer) {
    answer.set_id(to.id);
    if (answer.has_status()) answer.mutable_status()->set_role(name_of(to.role));
    listener.socket().catch_up();
    for (const std::string& frame : to.route) {
      if (zmq_send(listener.socket().get(), frame.data(), frame.size(), ZMQ_DONTWAIT | ZMQ_SNDMORE) < 0) return;
    }
    const std::string out = answer.SerializeAsString();
    zmq_send(listener.socket().get(), out.data(), out.size(), ZMQ_DONTWAIT);
  }

  void refuse(v1::Code code, const std::string& why) {
    if (audit != nullptr) {
      audit->note({.what = "refused",
                   .who = sender,
                   .details = {{"socket", kWho}, {"order", order_name(request)}, {"reason", why}}});
    }
    v1::Answer answer;
    answer.set_code(code);
    answer.set_message(why);
    send(last, answer);
  }

  // Decodes the received request. Answers a malformed or forbidden request itself and returns nothing.
  std::optional<ControlRequest> read() {
    last.id = 0;
    request.Clear();
    sender.states.clear();
    if (!request.ParseFromString(bytes)) {
      refuse(v1::CODE_INVALID, "not a request of mocap.v1 in Protobuf");
      return std::nullopt;
    }
    last.id = request.id();
    sender.states = request.asked_by().substr(0, kLongestStated);
    Result<ControlRequest> wanted = decode(request);
    if (!wanted) {
      refuse(v1::CODE_INVALID, wanted.error().message);
      return std::nullopt;
    }
    if (last.role == Role::Viewer && !only_looks(wanted->action)) {
      refuse(v1::CODE_FORBIDDEN, "this needs the role operator; mocapctl keys allow --role operator gives it to a key");
      return std::nullopt;
    }
    wanted->by = sender;
    wanted->number = ++requests;
    open.emplace(wanted->number, last);
    return *std::move(wanted);
  }
};

ZmqControl::ZmqControl(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ZmqControl::~ZmqControl() = default;

const std::string& ZmqControl::endpoint() const { return impl_->listener.endpoints().front(); }

Result<std::unique_ptr<ZmqControl>> ZmqControl::open(const ControlSettings& settings, AuditTrail* audit) {
  // Malformed requests are answered with an error. Without this call Protobuf would also write them to standard error.
  google::protobuf::SetLogHandler(nullptr);
  auto impl = std::make_unique<Impl>();
  impl->role_without_keys = settings.role_without_keys;
  impl->audit = audit;
  ListenSettings listen;
  listen.endpoints = {settings.endpoint};
  listen.endpoints.insert(listen.endpoints.end(), settings.more_endpoints.begin(), settings.more_endpoints.end());
  listen.allow_remote = settings.allow_remote;
  listen.curve = settings.curve;
  listen.audit = audit;
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
    const Impl::Received received = impl_->receive();
    if (received == Impl::Received::Request) {
      if (std::optional<ControlRequest> wanted = impl_->read()) return wanted;
    }
    const Duration left = until - host_now();
    if (left <= Duration::zero()) return std::nullopt;
    if (received == Impl::Received::Nothing) impl_->wait(std::min(left, kLongestWait));
  }
}

void ZmqControl::answer(std::uint64_t request, const ControlAnswer& answer) {
  const auto asked = impl_->open.extract(request);
  MOCAP_EXPECTS(!asked.empty());
  v1::Answer out = encode(answer);
  impl_->send(asked.mapped(), out);
}

ControlClient::ControlClient(std::unique_ptr<RequestSocket> socket) : socket_(std::move(socket)) {}
ControlClient::~ControlClient() = default;

Result<std::unique_ptr<ControlClient>> ControlClient::open(const Settings& settings) {
  std::string fault;
  auto socket = RequestSocket::open({.endpoint = settings.endpoint,
                                     .server_key = settings.keys.server_key,
                                     .public_key = settings.keys.own_key.public_key,
                                     .secret_key = settings.keys.own_key.secret_key},
                                    fault);
  if (socket == nullptr) return Error{ErrorCode::InvalidArgument, fault};
  return std::unique_ptr<ControlClient>(new ControlClient(std::move(socket)));
}

Result<std::string> ControlClient::ask(const std::string& request, Duration patience) {
  Reply reply = socket_->ask(request, patience);
  if (reply.bytes) return *std::move(reply.bytes);
  return Error{reply.fault == LinkFault::None ? ErrorCode::Timeout : ErrorCode::DeviceLost, std::move(reply.why)};
}

}  // namespace mocap::wire
