#pragma once

#include <chrono>
#include <cstdint>

#include "base/time.h"

namespace mocap::wire {

/// Version of the messages between a fusion host and a node (proto/mocap/v1/node.proto).
inline constexpr std::uint32_t kNodeProtocol = 1;
/// Period of the calls of a host's only camera of a node: five of them in each half second, of which the clock mapping
/// keeps the one with the least delay.
inline constexpr Duration kNodeCallEvery = std::chrono::milliseconds(100);
/// A node sends images to a host for this time after each call.
inline constexpr Duration kNodeLease = std::chrono::seconds(1);

}  // namespace mocap::wire
