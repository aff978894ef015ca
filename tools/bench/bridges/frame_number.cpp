#include "bench/bridges/frame_number.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

namespace mocap::bench {
namespace {

// Precondition: the packet has these bytes.
template <class T>
T read(std::string_view packet, std::size_t at) {
  T value{};
  std::memcpy(&value, packet.data() + at, sizeof value);
  return value;
}

std::uint32_t read_big_endian(std::string_view packet, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < sizeof value; ++i) value = value << 8U | static_cast<unsigned char>(packet[at + i]);
  return value;
}

}  // namespace

std::optional<std::uint64_t> natnet_number(std::string_view packet) {
  constexpr std::uint16_t kFrame = 7;
  constexpr std::size_t kHeader_bytes = 4;
  if (packet.size() < kHeader_bytes + sizeof(std::uint32_t) || read<std::uint16_t>(packet, 0) != kFrame) return {};
  return read<std::uint32_t>(packet, kHeader_bytes);
}

std::optional<std::uint64_t> vrpn_number(std::string_view packet, const FrameTimes& times) {
  constexpr std::size_t kHeader_bytes = 24;
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  if (packet.size() < kHeader_bytes) return {};
  const std::int64_t seconds = read_big_endian(packet, 4);
  const std::int64_t microseconds = read_big_endian(packet, 8);
  return times.number_at(seconds * kSecond_ns + microseconds * 1000 - times.utc_minus_host_ns);
}

std::optional<std::uint64_t> rokoko_number(std::string_view packet, const FrameTimes& times) {
  constexpr std::string_view kKey = R"("timestamp":)";
  constexpr double kSecond_ns = 1e9;
  const std::size_t key = packet.find(kKey);
  if (key == std::string_view::npos) return {};
  const char* const begin = packet.data() + key + kKey.size();
  double seconds = 0.0;
  if (std::from_chars(begin, packet.data() + packet.size(), seconds).ec != std::errc()) return {};
  return times.number_at(std::llround(seconds * kSecond_ns));
}

std::optional<std::uint64_t> vmc_number(std::string_view packet) {
  constexpr std::string_view kName{"Hips\0\0\0\0", 8};
  constexpr std::size_t kPosition_bytes = 12;
  constexpr std::size_t kZ = 8;
  const std::size_t name = packet.find(kName);
  if (name == std::string_view::npos || name + kName.size() + kPosition_bytes > packet.size()) return {};
  const float z = std::bit_cast<float>(read_big_endian(packet, name + kName.size() + kZ));
  const double steps = std::round(static_cast<double>(z) / kStep_m);
  constexpr double kMax = 16'777'216.0;  // 2^24
  if (!(steps >= 0.0 && steps <= kMax)) return {};
  return static_cast<std::uint64_t>(steps);
}

std::optional<std::uint64_t> reference_number(std::string_view packet) {
  if (packet.size() < sizeof(std::uint64_t)) return {};
  return read<std::uint64_t>(packet, 0);
}

}  // namespace mocap::bench
