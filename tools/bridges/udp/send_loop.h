#pragma once

#include <string>

#include "bridges/udp/packet_writer.h"
#include "bridges/udp/send_options.h"

namespace mocap::bridge {

/// Sends each frame of the feed to every receiver as soon as it arrives, until SIGINT, SIGTERM or the end of the time.
/// Once a second without frames, the writer's packets for a silent feed. Reports on stderr as `program`: the reason why
/// no data arrives whenever it changes, and in the end the counts.
///
/// Returns the exit code: 0 (also if a signal came before the first frame), 64 (an option is invalid) or 69 (no frame
/// came in the time, or a receiver's name is unknown).
int send_until_stopped(const std::string& program, SendOptions options, PacketWriter& writer);

}  // namespace mocap::bridge
