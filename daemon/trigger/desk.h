#pragma once

#include <cstdint>
#include <memory>

#include "module/trigger_desk.h"
#include "trigger/trigger_settings.h"

namespace mocap::trigger {

/// Makes the desk. Its sockets are those of `sockets_of(settings)`. `first_packet_id`: of its own packets; another one
/// than in the last minutes of the run before, because receivers ignore a PacketID that they have seen.
std::unique_ptr<TriggerDesk> make_desk(const TriggerSettings& settings, std::uint64_t first_packet_id);

}  // namespace mocap::trigger
