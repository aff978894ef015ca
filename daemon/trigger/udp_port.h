#pragma once

#include <memory>

#include "base/result.h"
#include "module/datagram_port.h"
#include "trigger/trigger_settings.h"

namespace mocap::trigger {

/// Opens the sockets of `sockets_of(settings)`. A datagram over kMaxPacket_bytes is received cut. Fails with Busy (the
/// port is in use), NotFound (this machine does not have the address) or Io.
Result<std::unique_ptr<DatagramPort>> open_udp_port(const TriggerSettings& settings);

/// Opens the sockets for an instant. Fails as open_udp_port if they could not be opened once those of `before` are
/// closed: of the ports of these only the address is tried.
Status try_udp_ports(const TriggerSettings& settings, const TriggerSettings& before);

}  // namespace mocap::trigger
