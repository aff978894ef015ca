#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/snapshot.h"

namespace mocap::wire {

/// Formats a snapshot as one line of Protobuf's canonical JSON, without a newline. Simulators write ground truth and
/// mocap-watch writes streams in this format. Equal snapshots give equal bytes.
std::string to_json_line(const Snapshot& snapshot);
std::string to_json_line(const v1::Snapshot& message);

/// Parses a line of `to_json_line`. Unknown fields are ignored. Fails with InvalidArgument; the message names the
/// fault.
Result<Snapshot> from_json_line(std::string_view line);

/// Parses a line into the message, which also contains the sender's fields (sequence, utc_minus_host_ns).
Result<v1::Snapshot> message_from_json_line(std::string_view line);

}  // namespace mocap::wire
