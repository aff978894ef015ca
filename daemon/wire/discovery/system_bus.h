#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"

struct sd_bus;  // of sd-bus (libsystemd)
struct sd_bus_message;

namespace mocap::wire {

/// DNS-SD service type of a node (RFC 6763); its TXT records: protocol, keys.
inline constexpr const char* kNodeService = "_mocapd-node._tcp";

struct BusMessageDeleter {
  void operator()(sd_bus_message* message) const;
};
using BusMessage = std::unique_ptr<sd_bus_message, BusMessageDeleter>;
/// Reads a signal.
using BusHandler = std::function<void(sd_bus_message*)>;

/// A method of an object of Avahi (its D-Bus interfaces: avahi.org, *.introspect), without the prefix
/// org.freedesktop.Avahi.
struct AvahiMethod {
  std::string path = "/";
  std::string interface = "Server";
  std::string name;
};

/// A connection to the message bus of the system, over which Avahi is asked. One thread owns it.
class SystemBus {
 public:
  /// Fails with NotFound if there is no bus.
  static Result<SystemBus> open();

  /// A call to be completed by sd_bus_message_append.
  Result<BusMessage> make_call(const AvahiMethod& method);
  /// Fails with NotFound if Avahi does not run, with Busy if it knows the name of the service already, and with Io.
  Result<BusMessage> call(BusMessage call);

  /// Calls `handler` for each signal of Avahi with this interface and name, of any object.
  Status match(const std::string& interface, const std::string& name, BusHandler handler);
  /// Calls `handler` when Avahi starts or ends.
  Status match_restart(BusHandler handler);

  /// Waits at most `patience` for messages, or until `wake` is readable (-1: nothing), and processes what has arrived.
  /// Fails with Io after the connection was closed.
  Status serve(Duration patience, int wake = -1);

 private:
  struct Closer {
    void operator()(sd_bus* bus) const;
  };
  explicit SystemBus(sd_bus* bus) : bus_(bus) {}
  BusHandler* keep(BusHandler handler);
  Status process();
  std::vector<std::unique_ptr<BusHandler>> handlers_;  // the bus has their addresses
  std::unique_ptr<sd_bus, Closer> bus_;
};

}  // namespace mocap::wire
