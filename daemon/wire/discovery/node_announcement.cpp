#include "wire/discovery/node_announcement.h"

#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <systemd/sd-bus.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <utility>

#include "base/log.h"
#include "wire/discovery/system_bus.h"
#include "wire/endpoint.h"
#include "wire/node_protocol.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace {

constexpr Duration kAnnounceRetry = std::chrono::seconds(10);
constexpr int kMostNames = 9;                // nodes of one name in a network
constexpr std::int32_t kStateCollision = 3;  // avahi-common/defs.h: AVAHI_ENTRY_GROUP_COLLISION
constexpr std::int32_t kAnyInterface = -1, kAnyProtocol = -1;

// The answers of the bus that its callbacks store.
struct Heard {
  bool collision = false;
  bool restarted = false;  // Avahi started or ended
};

bool is_collision(sd_bus_message* signal) {
  std::int32_t state = 0;
  return sd_bus_message_read(signal, "i", &state) >= 0 && state == kStateCollision;
}

Status append_service(sd_bus_message* call, const AnnouncedNode& node, const std::string& name) {
  const std::string records[] = {fmt::format("protocol={}", kNodeProtocol),
                                 fmt::format("keys={}", node.keys ? "curve" : "none")};
  int code = sd_bus_message_append(call, "iiussssq", kAnyInterface, kAnyProtocol, std::uint32_t{0}, name.c_str(),
                                   kNodeService, "", "", node.port);
  if (code >= 0) code = sd_bus_message_open_container(call, 'a', "ay");
  for (const std::string& record : records) {
    if (code >= 0) code = sd_bus_message_append_array(call, 'y', record.data(), record.size());
  }
  if (code >= 0) code = sd_bus_message_close_container(call);
  if (code < 0) return Error{ErrorCode::Io, "the announcement cannot be written to the message bus"};
  return {};
}

// Avahi forgets the service when this connection to the bus ends.
Status add_service(SystemBus& bus, const AnnouncedNode& node, const std::string& name) {
  Result<BusMessage> call = bus.make_call({.name = "EntryGroupNew"});
  if (!call) return call.error();
  const Result<BusMessage> group = bus.call(std::move(*call));
  if (!group) return group.error();
  const char* path = nullptr;
  if (sd_bus_message_read(group->get(), "o", &path) < 0) return Error{ErrorCode::Io, "Avahi named no group"};
  const std::string group_path = path;
  call = bus.make_call({group_path, "EntryGroup", "AddService"});
  if (!call) return call.error();
  if (Status appended = append_service(call->get(), node, name); !appended) return appended;
  if (const auto added = bus.call(std::move(*call)); !added) return added.error();
  call = bus.make_call({group_path, "EntryGroup", "Commit"});
  if (!call) return call.error();
  if (const auto committed = bus.call(std::move(*call)); !committed) return committed.error();
  return {};
}

// Announces until Avahi ends, the name is taken (Busy) or the thread shall stop (success).
Status announce(const AnnouncedNode& node, const std::string& name, const std::stop_token& stop, int wake) {
  Result<SystemBus> bus = SystemBus::open();
  if (!bus) return bus.error();
  Heard heard;
  const auto on_state = [&heard](sd_bus_message* signal) { heard.collision = heard.collision || is_collision(signal); };
  const auto on_restart = [&heard](sd_bus_message*) { heard.restarted = true; };
  if (Status matched = bus->match("EntryGroup", "StateChanged", on_state); !matched) return matched;
  if (Status matched = bus->match_restart(on_restart); !matched) return matched;
  if (Status added = add_service(*bus, node, name); !added) return added;
  // Avahi may have been started for this call.
  heard.restarted = false;
  log_info("node", fmt::format("announced as '{}' by DNS-SD: {}, port {}", name, kNodeService, node.port));
  while (!stop.stop_requested()) {
    if (Status served = bus->serve(kAnnounceRetry, wake); !served) return served;
    if (heard.collision) return Error{ErrorCode::Busy, "another node of the network has this name"};
    if (heard.restarted) return Error{ErrorCode::Io, "Avahi ended"};
  }
  return {};
}

}  // namespace

std::uint16_t port_for_others(const std::vector<std::string>& endpoints) {
  const auto remote = [](const std::string& each) { return each.starts_with("tcp://") && !is_local(each); };
  const auto found = std::ranges::find_if(endpoints, remote);
  if (found == endpoints.end()) return 0;
  std::uint16_t port = 0;
  const char* const digits = found->data() + found->rfind(':') + 1;
  std::from_chars(digits, found->data() + found->size(), port);
  return port;
}

NodeAnnouncement::NodeAnnouncement(AnnouncedNode node) : node_(std::move(node)) {
  thread_ = std::jthread([this](const std::stop_token& stop) {
    ::pthread_setname_np(::pthread_self(), "mocap-announce");
    run(stop);
  });
}

NodeAnnouncement::~NodeAnnouncement() {
  thread_.request_stop();
  wake_.signal();
}

void NodeAnnouncement::run(const std::stop_token& stop) {
  std::string told;
  int number = 1;
  while (!stop.stop_requested()) {
    const std::string name = number == 1 ? node_.name : fmt::format("{} #{}", node_.name, number);
    const Status ended = announce(node_, name, stop, wake_.number());
    if (ended) return;
    if (ended.error().code == ErrorCode::Busy && number < kMostNames) {
      ++number;
      continue;
    }
    number = 1;
    if (told != ended.error().message) {
      told = ended.error().message;
      log_info("node", fmt::format("not announced in the network: {}; hosts need the address of this machine", told));
    }
    pollfd wake{wake_.number(), POLLIN, 0};
    ::poll(&wake, 1, static_cast<int>(whole_ms(kAnnounceRetry)));
  }
}

}  // namespace mocap::wire
