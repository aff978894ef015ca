#include "wire/discovery/system_bus.h"

#include <fmt/format.h>
#include <poll.h>
#include <systemd/sd-bus.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>

#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace {

constexpr const char* kAvahi = "org.freedesktop.Avahi";
constexpr std::uint64_t kAvahiPatience_us = 2'000'000;  // Avahi answers within a millisecond

std::string interface_of(const std::string& name) { return fmt::format("{}.{}", kAvahi, name); }

Error bus_failure(int code, std::string_view what) {
  return {ErrorCode::Io, fmt::format("{}: {}", what, std::strerror(-code))};
}

Error avahi_failure(const sd_bus_error& fault) {
  const std::string_view name = fault.name == nullptr ? "" : fault.name;
  const std::string_view text = fault.message == nullptr ? name : fault.message;
  if (name.ends_with(".CollisionError")) return {ErrorCode::Busy, std::string(text)};
  if (name.starts_with(interface_of(""))) return {ErrorCode::Io, fmt::format("Avahi: {}", text)};
  return {ErrorCode::NotFound, "Avahi does not run here; install and start it: apt install avahi-daemon"};
}

int call_handler(sd_bus_message* signal, void* handler, sd_bus_error*) {
  (*static_cast<BusHandler*>(handler))(signal);
  return 0;
}

}  // namespace

void BusMessageDeleter::operator()(sd_bus_message* message) const { sd_bus_message_unref(message); }
void SystemBus::Closer::operator()(sd_bus* bus) const { sd_bus_flush_close_unref(bus); }

BusHandler* SystemBus::keep(BusHandler handler) {
  return handlers_.emplace_back(std::make_unique<BusHandler>(std::move(handler))).get();
}

Result<SystemBus> SystemBus::open() {
  sd_bus* bus = nullptr;
  if (const int code = sd_bus_open_system(&bus); code < 0) {
    return Error{ErrorCode::NotFound,
                 bus_failure(code, "no message bus of the system, over which Avahi is asked").message};
  }
  sd_bus_set_method_call_timeout(bus, kAvahiPatience_us);
  return SystemBus(bus);
}

Result<BusMessage> SystemBus::make_call(const AvahiMethod& method) {
  sd_bus_message* call = nullptr;
  const int code = sd_bus_message_new_method_call(bus_.get(), &call, kAvahi, method.path.c_str(),
                                                  interface_of(method.interface).c_str(), method.name.c_str());
  if (code < 0) return bus_failure(code, method.name);
  return BusMessage(call);
}

Result<BusMessage> SystemBus::call(BusMessage call) {
  sd_bus_error fault = SD_BUS_ERROR_NULL;
  sd_bus_message* reply = nullptr;
  const int code = sd_bus_call(bus_.get(), call.get(), 0, &fault, &reply);
  BusMessage answer(reply);
  if (code >= 0) return answer;
  const Error error = avahi_failure(fault);
  sd_bus_error_free(&fault);
  return error;
}

Status SystemBus::match(const std::string& interface, const std::string& name, BusHandler handler) {
  const int code = sd_bus_match_signal(bus_.get(), nullptr, nullptr, nullptr, interface_of(interface).c_str(),
                                       name.c_str(), call_handler, keep(std::move(handler)));
  if (code < 0) return bus_failure(code, name);
  return {};
}

Status SystemBus::match_restart(BusHandler handler) {
  const std::string rule = fmt::format(
      "type='signal',sender='org.freedesktop.DBus',interface='org.freedesktop.DBus',member='NameOwnerChanged',"
      "arg0='{}'",
      kAvahi);
  const int code = sd_bus_add_match(bus_.get(), nullptr, rule.c_str(), call_handler, keep(std::move(handler)));
  if (code < 0) return bus_failure(code, "NameOwnerChanged");
  return {};
}

Status SystemBus::process() {
  int code = 0;
  do {
    code = sd_bus_process(bus_.get(), nullptr);
  } while (code > 0);
  if (code < 0) return bus_failure(code, "the message bus of the system");
  return {};
}

Status SystemBus::serve(Duration patience, int wake) {
  // Signals that came with the answer to a call wait here, not in the socket.
  if (Status processed = process(); !processed) return processed;
  pollfd items[2] = {{sd_bus_get_fd(bus_.get()), static_cast<short>(sd_bus_get_events(bus_.get())), 0},
                     {wake, POLLIN, 0}};
  ::poll(items, wake < 0 ? 1 : 2, static_cast<int>(std::max(0L, whole_ms(patience))));
  return process();
}

}  // namespace mocap::wire
