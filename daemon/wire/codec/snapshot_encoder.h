#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "model/snapshot.h"
#include "wire/codec/encode.h"

namespace mocap::wire {

/// Fields of a message that the sender sets.
struct SenderFields {
  std::optional<std::uint64_t> sequence;
  std::optional<std::int64_t> utc_minus_host_ns;
  std::optional<v1::Synchronisation> synchronisation;
};

/// Encodes snapshots directly to bytes, without generated Protobuf classes. The bytes equal the serialised result of
/// `encode`. The message is written from its end to its beginning, so each length is known when it is written
/// (decisions/0001; cost: mocap-bench feed).
class SnapshotEncoder {
 public:
  /// Returns `head` followed by the message; valid until the next call. Allocates only when a snapshot is larger than
  /// all before.
  std::span<const std::uint8_t> encode(std::string_view head, const Snapshot& from, const Parts& parts,
                                       const SenderFields& sender);

 private:
  std::vector<std::uint8_t> bytes_;
};

}  // namespace mocap::wire
