#pragma once

#include <memory>

#include "base/result.h"
#include "module/datagram_port.h"
#include "trigger/trigger_settings.h"

namespace mocap::trigger {

/// Opens the sockets of `sockets_of(settings)`. A datagram over kMaxPacket_bytes is received cut. Fails with Busy (the
/// port is in use), NotFound (this machine does not have the address) or Io.
Result<std::unique_ptr<DatagramPort>> open_udp_port(const TriggerSettings& settings);

}  // namespace mocap::trigger
