#include "cameras/tcp/tcp_header.h"

#include <fmt/format.h>

#include "cameras/image_layout.h"

namespace mocap::cameras {
namespace {

constexpr std::uint64_t kMagic = 0x4652434d;  // the characters "MCRF", little endian
constexpr std::uint64_t kVersion = 1;

std::uint64_t little_endian(std::span<const std::byte> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | std::to_integer<std::uint64_t>(bytes[i]);
  return value;
}

// Number of a pixel format on the wire. A number is never given to another format.
std::uint64_t code_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::Mono10: return 2;
    case PixelFormat::Mono12: return 3;
    default: return 1;
  }
}

}  // namespace

std::size_t tcp_image_bytes(const TcpSettings& settings) {
  return packed_stride_bytes(settings.pixel_format, settings.width_px) * static_cast<std::size_t>(settings.height_px);
}

Result<TcpHeader> parse_tcp_header(std::span<const std::byte, kTcpHeader_bytes> bytes, const TcpSettings& settings) {
  struct Constant {
    const char* name;
    std::size_t offset, size;
    std::uint64_t expected;
  };
  const Constant constants[] = {
      {"magic", 0, 4, kMagic},
      {"version", 4, 2, kVersion},
      {"pixel format", 6, 2, code_of(settings.pixel_format)},
      {"width", 8, 4, static_cast<std::uint64_t>(settings.width_px)},
      {"height", 12, 4, static_cast<std::uint64_t>(settings.height_px)},
      {"byte count", 32, 4, tcp_image_bytes(settings)},
      {"reserved field", 36, 4, 0},
  };
  for (const Constant& each : constants) {
    const std::uint64_t value = little_endian(bytes.subspan(each.offset, each.size));
    if (value == each.expected) continue;
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("the {} in the header is {}, expected {}; let the program at this address send the format "
                             "of daemon/cameras/tcp/README.md with pixel_format, width_px and height_px of this camera",
                             each.name, value, each.expected)};
  }
  return TcpHeader{little_endian(bytes.subspan(16, 8)),
                   Duration{static_cast<Duration::rep>(little_endian(bytes.subspan(24, 8)))}};
}

}  // namespace mocap::cameras
