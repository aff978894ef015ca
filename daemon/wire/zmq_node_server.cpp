#include "wire/zmq_node_server.h"

#include <fmt/format.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <optional>
#include <random>
#include <set>
#include <utility>

#include "base/log.h"
#include "mocap/v1/node.pb.h"
#include "wire/codec/camera_blobs.h"
#include "wire/discovery/node_announcement.h"
#include "wire/listener.h"
#include "wire/node_protocol.h"

namespace mocap::wire {
namespace {

constexpr const char* kNodeWho = "node";
constexpr std::size_t kMaxNodeHosts = 256;  // 64 cameras for each of four hosts
constexpr int kCallsPerServe = 64;          // about 10 us each
constexpr int kMaxNodeConnections = 300;

std::uint64_t new_session() {
  std::random_device entropy;
  return (std::uint64_t{entropy()} << 32U) | entropy();
}

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "node";
}

v1::NodeEcho::CameraState to_wire(NodeCameraState state) {
  switch (state) {
    case NodeCameraState::NotYet: return v1::NodeEcho::CAMERA_STATE_UNSPECIFIED;
    case NodeCameraState::Delivering: return v1::NodeEcho::CAMERA_STATE_DELIVERING;
    case NodeCameraState::Ended: return v1::NodeEcho::CAMERA_STATE_ENDED;
  }
  return v1::NodeEcho::CAMERA_STATE_UNSPECIFIED;
}

}  // namespace

struct ZmqNodeServer::Impl {
  // One camera of one host.
  struct Host {
    std::string route;
    CameraId camera;
    std::uint64_t sequence = 0;
    Timestamp called_at;
  };

  NodeServerSettings settings;
  std::string name;
  std::uint64_t session = new_session();
  Listener listener{kNodeWho};
  WakeDescriptor wake;
  std::vector<Host> hosts;
  std::set<std::uint32_t> acknowledged;  // by camera
  v1::NodeCall call;
  v1::NodeMessage message;
  std::string bytes;
  std::optional<NodeAnnouncement> announcement;

  void announce() {
    const std::uint16_t port = port_for_others(listener.endpoints());
    if (!settings.node.announce || port == 0) return;
    announcement.emplace(AnnouncedNode{name, port, settings.node.curve.on()});
  }

  Timestamp node_time(Timestamp host) const { return settings.clock ? settings.clock(host) : host; }

  void wait(Duration patience) {
    zmq_pollitem_t items[3] = {{listener.socket().get(), 0, ZMQ_POLLIN, 0},
                               {nullptr, wake.number(), ZMQ_POLLIN, 0},
                               {listener.asking_socket(), 0, ZMQ_POLLIN, 0}};
    zmq_poll(items, items[2].socket == nullptr ? 2 : 3, whole_ms(patience));
    wake.clear();
  }

  // Receives one message; returns its sender, empty if none waits. Malformed messages leave `bytes` empty.
  std::string receive() {
    bytes.clear();
    ZmqMessage part;
    if (!part.receive(listener.socket())) {
      listener.heard_all();
      return {};
    }
    std::string route(part.bytes());
    std::size_t parts = 1;
    while (part.has_more() && part.receive(listener.socket())) {
      if (!listener.gone().contains(part.connection())) listener.note_user(part.connection(), part.user());
      if (++parts == 2 && !part.has_more()) bytes = part.bytes();
    }
    return route;
  }

  // Returns false if the message was not sent; then errno is EAGAIN (no room) or EHOSTUNREACH (the host has gone).
  bool send_to(const std::string& route) {
    if (zmq_send(listener.socket().get(), route.data(), route.size(), ZMQ_DONTWAIT | ZMQ_SNDMORE) < 0) return false;
    return zmq_send(listener.socket().get(), bytes.data(), bytes.size(), ZMQ_DONTWAIT) >= 0;
  }

  void refuse(const std::string& route, const std::string& why) {
    message.set_refusal(why);
    message.SerializeToString(&bytes);
    static_cast<void>(send_to(route));
  }

  void answer(const std::string& route, Timestamp received_at, const std::vector<NodeCamera>& cameras) {
    if (!call.ParseFromString(bytes)) return refuse(route, "not a call of mocap.v1 in Protobuf");
    if (call.protocol() != kNodeProtocol) {
      return refuse(route, fmt::format("node '{}' has protocol {}, the fusion host {}: install the same version of "
                                       "mocapd on both",
                                       name, kNodeProtocol, call.protocol()));
    }
    if (call.camera().empty()) return list_cameras(route, received_at, cameras);
    const auto found = std::ranges::find(cameras, call.camera(), &NodeCamera::name);
    if (found == cameras.end()) {
      std::string names;
      for (const NodeCamera& camera : cameras) names += (names.empty() ? "" : ", ") + camera.name;
      return refuse(route, fmt::format("node '{}' has no camera '{}', only {}", name, call.camera(), names));
    }
    const CameraId id{static_cast<std::uint32_t>(found - cameras.begin())};
    if (call.ended()) acknowledged.insert(id.value);
    // A host takes no images before it knows their size, and no image of a recording may be lost.
    if (!settings.recorded || found->width_px != 0) {
      Host* host = host_of(route, id, received_at);
      if (host == nullptr) {
        return refuse(route, fmt::format("node '{}' plays a recording, or has {} hosts: no further host is served",
                                         name, hosts.size()));
      }
      host->called_at = received_at;
    }
    v1::NodeEcho& echo = begin_echo(received_at);
    echo.set_width_px(found->width_px);
    echo.set_height_px(found->height_px);
    echo.set_state(to_wire(found->state));
    end_echo(route);
  }

  // The answer to somebody who wants no images.
  void list_cameras(const std::string& route, Timestamp received_at, const std::vector<NodeCamera>& cameras) {
    v1::NodeEcho& echo = begin_echo(received_at);
    for (const NodeCamera& camera : cameras) {
      v1::NodeEcho::Camera& to = *echo.add_cameras();
      to.set_name(camera.name);
      to.set_width_px(camera.width_px);
      to.set_height_px(camera.height_px);
      to.set_state(to_wire(camera.state));
    }
    end_echo(route);
  }

  v1::NodeEcho& begin_echo(Timestamp received_at) {
    v1::NodeEcho& echo = *message.mutable_echo();
    echo.Clear();
    echo.set_called_at_ns(call.called_at_ns());
    echo.set_received_at_ns(to_ns(node_time(received_at)));
    echo.set_node(name);
    echo.set_session(session);
    echo.set_recorded(settings.recorded);
    echo.set_control(settings.control);
    return echo;
  }

  void end_echo(const std::string& route) {
    v1::NodeEcho& echo = *message.mutable_echo();
    const Timestamp now = host_now();
    if (const auto line = settings.ptp != nullptr ? settings.ptp->line(now) : std::nullopt) {
      v1::NodeEcho::PtpTime& ptp = *echo.mutable_ptp();
      ptp.set_grandmaster(line->grandmaster);
      ptp.set_time_ns(line->ptp.count());
      ptp.set_rate(line->rate);
      ptp.set_uncertainty_ns(line->uncertainty.count());
    }
    echo.set_sent_at_ns(to_ns(node_time(now)));
    message.SerializeToString(&bytes);
    static_cast<void>(send_to(route));
  }

  // The entry of a host; null if no further host is served.
  Host* host_of(const std::string& route, CameraId camera, Timestamp now) {
    const auto same = [&](const Host& host) { return host.route == route && host.camera == camera; };
    const auto found = std::ranges::find_if(hosts, same);
    if (found != hosts.end()) return &*found;
    const bool taken = settings.recorded && std::ranges::find(hosts, camera, &Host::camera) != hosts.end();
    if (taken || hosts.size() >= kMaxNodeHosts) return nullptr;
    hosts.push_back({route, camera, 0, now});
    return &hosts.back();
  }

  // A host of a recording may be busy for longer than a second.
  void forget_silent(Timestamp now) {
    if (settings.recorded) return;
    std::erase_if(hosts, [&](const Host& host) { return now - host.called_at > kNodeLease; });
  }
};

ZmqNodeServer::ZmqNodeServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ZmqNodeServer::~ZmqNodeServer() = default;

Result<std::unique_ptr<ZmqNodeServer>> ZmqNodeServer::open(const NodeServerSettings& settings, AuditTrail* audit) {
  auto impl = std::make_unique<Impl>();
  impl->settings = settings;
  impl->name = settings.node.name.empty() ? host_name() : settings.node.name;
  impl->hosts.reserve(kMaxNodeHosts);
  ListenSettings listen;
  listen.endpoints = {settings.node.endpoint};
  listen.endpoints.insert(listen.endpoints.end(), settings.node.more_endpoints.begin(),
                          settings.node.more_endpoints.end());
  listen.allow_remote = settings.node.allow_remote;
  listen.curve = settings.node.curve;
  listen.audit = audit;
  listen.max_connections = kMaxNodeConnections;
  if (Status opened = impl->listener.open(ZMQ_ROUTER, settings.node.send_queue, listen); !opened) return opened.error();
  // A full queue and a host that has gone are errors of the send, not a silent loss.
  if (Status set = impl->listener.socket().set(ZMQ_ROUTER_MANDATORY, 1); !set) return set.error();
  impl->announce();
  return std::unique_ptr<ZmqNodeServer>(new ZmqNodeServer(std::move(impl)));
}

void ZmqNodeServer::serve(const std::vector<NodeCamera>& cameras, Duration patience) {
  Impl& impl = *impl_;
  impl.wait(patience);
  for (int i = 0; i < kCallsPerServe; ++i) {
    const std::string route = impl.receive();
    if (route.empty()) break;
    impl.answer(route, host_now(), cameras);
  }
  const Timestamp now = host_now();
  impl.listener.serve(now);
  impl.forget_silent(now);
}

NodeSend ZmqNodeServer::send(const BlobFrame& frame) {
  Impl& impl = *impl_;
  NodeSend result = NodeSend::NoHost;
  impl.listener.socket().catch_up();
  v1::NodeImage& image = *impl.message.mutable_image();
  for (std::size_t i = 0; i < impl.hosts.size();) {
    Impl::Host& host = impl.hosts[i];
    if (host.camera != frame.camera) {
      ++i;
      continue;
    }
    if (result == NodeSend::NoHost) {
      encode(frame, *image.mutable_blobs());
      if (impl.settings.clock) {
        image.mutable_blobs()->set_exposed_at_ns(to_ns(impl.node_time(frame.exposed_at)));
        image.mutable_blobs()->set_received_at_ns(to_ns(impl.node_time(frame.received_at)));
        image.mutable_blobs()->set_detected_at_ns(to_ns(impl.node_time(frame.detected_at)));
      }
      result = NodeSend::Done;
    }
    image.set_sequence(host.sequence);
    impl.message.SerializeToString(&impl.bytes);
    const bool sent = impl.send_to(host.route);
    if (!sent && zmq_errno() == EHOSTUNREACH) {
      impl.hosts.erase(impl.hosts.begin() + static_cast<std::ptrdiff_t>(i));
      if (impl.settings.recorded) return NodeSend::NoHost;
      continue;
    }
    if (!sent && impl.settings.recorded) return NodeSend::NoRoom;
    ++host.sequence;
    ++i;
  }
  return result;
}

bool ZmqNodeServer::acknowledged(CameraId camera) const { return impl_->acknowledged.contains(camera.value); }

WakeDescriptor& ZmqNodeServer::wake() { return impl_->wake; }

const std::vector<std::string>& ZmqNodeServer::endpoints() const { return impl_->listener.endpoints(); }

}  // namespace mocap::wire
