#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/result.h"
#include "base/time.h"
#include "cameras/tcp/tcp_settings.h"

namespace mocap::cameras {

/// Length of the header that precedes the pixels of each image. README.md of this folder lists its fields.
inline constexpr std::size_t kTcpHeader_bytes = 40;

/// The fields of a header that vary from image to image. The others are constants of the connection.
struct TcpHeader {
  std::uint64_t frame_number = 0;
  Duration stamp{};  ///< middle of the exposure by the sender's clock, since that clock's epoch
};

/// Number of bytes that the pixels of each image take; rows follow each other without a gap.
std::size_t tcp_image_bytes(const TcpSettings& settings);

/// Reads a header that announces an image as `settings` describe it.
///
/// Fails with InvalidArgument, naming the field, its value and what was expected, if any constant field differs: then
/// nothing is known about the bytes that follow. The two fields of TcpHeader may have any value. Allocates only on
/// failure.
Result<TcpHeader> parse_tcp_header(std::span<const std::byte, kTcpHeader_bytes> bytes, const TcpSettings& settings);

}  // namespace mocap::cameras
