#include "wire/discovery/announced_nodes.h"

#include <fmt/format.h>
#include <systemd/sd-bus.h>

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>

#include "wire/discovery/system_bus.h"

namespace mocap::wire {
namespace {

constexpr std::int32_t kIpv4 = 0;             // avahi-common/address.h: AVAHI_PROTO_INET
constexpr std::int32_t kEveryInterface = -1;  // AVAHI_IF_UNSPEC
constexpr std::size_t kMostServices = 1000;
constexpr Duration kBrowseStep = std::chrono::milliseconds(100);

struct Service {
  std::int32_t interface = 0;
  std::string name, domain;
};

struct Browsed {
  std::vector<Service> services;
  bool complete = false;
};

void note_service(sd_bus_message* signal, Browsed& browsed) {
  std::int32_t interface = 0, protocol = 0;
  const char *name = nullptr, *type = nullptr, *domain = nullptr;
  if (sd_bus_message_read(signal, "iisss", &interface, &protocol, &name, &type, &domain) < 0) return;
  if (std::string_view(type) != kNodeService || browsed.services.size() >= kMostServices) return;
  browsed.services.push_back({interface, name, domain});
}

// Other machines choose the text: one line of visible characters.
std::string visible(std::string_view text) {
  std::string line(text);
  std::ranges::replace_if(
      line, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, ' ');
  return line;
}

bool requires_key(sd_bus_message* reply) {
  bool required = false;
  if (sd_bus_message_enter_container(reply, 'a', "ay") < 0) return false;
  const void* record = nullptr;
  std::size_t size = 0;
  while (sd_bus_message_read_array(reply, 'y', &record, &size) > 0) {
    required = required || std::string_view(static_cast<const char*>(record), size) == "keys=curve";
  }
  return required;
}

Result<FoundNode> resolve(SystemBus& bus, const Service& service) {
  Result<BusMessage> call = bus.make_call({.name = "ResolveService"});
  if (!call) return call.error();
  sd_bus_message_append(call->get(), "iisssiu", service.interface, kIpv4, service.name.c_str(), kNodeService,
                        service.domain.c_str(), kIpv4, std::uint32_t{0});
  const Result<BusMessage> reply = bus.call(std::move(*call));
  if (!reply) return reply.error();
  std::int32_t interface = 0, protocol = 0, address_protocol = 0;
  const char *name = nullptr, *type = nullptr, *domain = nullptr, *machine = nullptr, *address = nullptr;
  std::uint16_t port = 0;
  if (sd_bus_message_read(reply->get(), "iissssisq", &interface, &protocol, &name, &type, &domain, &machine,
                          &address_protocol, &address, &port) < 0) {
    return Error{ErrorCode::Io, "Avahi gave an address in another form than ResolveService of its version 0.8"};
  }
  return FoundNode{visible(name), visible(machine), fmt::format("tcp://{}:{}", visible(address), port),
                   requires_key(reply->get())};
}

}  // namespace

Result<std::vector<FoundNode>> announced_nodes(Duration patience) {
  Result<SystemBus> bus = SystemBus::open();
  if (!bus) return bus.error();
  Browsed browsed;
  const auto on_item = [&browsed](sd_bus_message* signal) { note_service(signal, browsed); };
  const auto on_complete = [&browsed](sd_bus_message*) { browsed.complete = true; };
  // Before the browser exists: Avahi sends what it knows at once.
  if (Status ok = bus->match("ServiceBrowser", "ItemNew", on_item); !ok) return ok.error();
  if (Status ok = bus->match("ServiceBrowser", "AllForNow", on_complete); !ok) return ok.error();
  Result<BusMessage> call = bus->make_call({.name = "ServiceBrowserNew"});
  if (!call) return call.error();
  sd_bus_message_append(call->get(), "iissu", kEveryInterface, kIpv4, kNodeService, "", std::uint32_t{0});
  if (const auto browsing = bus->call(std::move(*call)); !browsing) return browsing.error();
  const Timestamp end = host_now() + patience;
  while (!browsed.complete && host_now() < end) {
    if (Status served = bus->serve(kBrowseStep); !served) return served.error();
  }
  std::vector<FoundNode> found;
  for (const Service& service : browsed.services) {
    // A node that left meanwhile has no address.
    if (Result<FoundNode> node = resolve(*bus, service); node) found.push_back(std::move(*node));
  }
  std::ranges::sort(found);
  const auto twice = std::ranges::unique(found);  // a machine with several interfaces
  found.erase(twice.begin(), twice.end());
  return found;
}

}  // namespace mocap::wire
