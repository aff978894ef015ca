#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "bench/bridges/frame_times.h"

namespace mocap::bench {

/// The hips of a frame are this far from the origin for each frame number, m. Single precision has these positions
/// exactly up to frame 2^24.
inline constexpr double kStep_m = 1.0 / 1024.0;

// Each function returns the number of the frame that a packet of the protocol shows, as the feed counts frames. Empty
// if the packet shows none: it is an answer, or a further part of the frame before.

/// NatNet: the number in the frame's header.
std::optional<std::uint64_t> natnet_number(std::string_view packet);
/// VRPN: the time stamp of the datagram's first message.
std::optional<std::uint64_t> vrpn_number(std::string_view packet, const FrameTimes& times);
/// Rokoko: the scene's time stamp.
std::optional<std::uint64_t> rokoko_number(std::string_view packet, const FrameTimes& times);
/// VMC has no time of the feed: the position of the bone Hips along z of Unity, in steps of kStep_m.
std::optional<std::uint64_t> vmc_number(std::string_view packet);
/// The reference: the first 8 bytes, in the machine's order.
std::optional<std::uint64_t> reference_number(std::string_view packet);

}  // namespace mocap::bench
