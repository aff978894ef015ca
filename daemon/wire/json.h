#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/snapshot.h"

namespace mocap::wire {

/// One snapshot as one line of Protobuf's canonical JSON, without the line's end: what simulators write as truth and
/// watchers as stream. The same snapshot gives the same bytes.
std::string to_json_line(const Snapshot& snapshot);
std::string to_json_line(const v1::Snapshot& message);

/// Fails with InvalidArgument, saying what is wrong with the line. Unknown names are ignored.
Result<Snapshot> from_json_line(std::string_view line);

/// The message itself, which also bears what belongs to the sender (sequence, UTC).
Result<v1::Snapshot> message_from_json_line(std::string_view line);

}  // namespace mocap::wire
