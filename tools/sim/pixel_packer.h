#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace mocap::sim {

/// Converts 8-bit pixels to another pixel format (GenICam PFNC). Pixels beyond the end of the output are dropped.
class Packer {
 public:
  Packer(std::span<std::byte> to, std::uint32_t pixel_format) : to_(to), format_(pixel_format) {}

  void add(std::span<const std::byte> row) {
    switch (format_) {
      case 0x010a0046: return packed(row, 10);  // Mono10p
      case 0x010c0047: return packed(row, 12);  // Mono12p
      case 0x010c0004:
      case 0x010c0006: return pairs(row);     // Mono10Packed, Mono12Packed
      case 0x01100003: return words(row, 2);  // Mono10
      case 0x01100005: return words(row, 4);  // Mono12
      case 0x01100007: return words(row, 8);  // Mono16
      default: break;
    }
    if (((format_ >> 16) & 0xff) != 8 || at_ + row.size() > to_.size()) return;
    std::memcpy(to_.data() + at_, row.data(), row.size());
    at_ += row.size();
  }

 private:
  void words(std::span<const std::byte> row, int shift) {
    for (const std::byte pixel : row) {
      if (at_ + 2 > to_.size()) return;
      const auto value = static_cast<std::uint16_t>(static_cast<unsigned>(pixel) << shift);
      to_[at_++] = static_cast<std::byte>(value & 0xff);
      to_[at_++] = static_cast<std::byte>(value >> 8);
    }
  }

  // The bit stream continues across row ends.
  void packed(std::span<const std::byte> row, unsigned bits) {
    for (const std::byte pixel : row) {
      pending_ |= (static_cast<unsigned>(pixel) << (bits - 8)) << pending_bits_;
      for (pending_bits_ += bits; pending_bits_ >= 8 && at_ < to_.size(); pending_bits_ -= 8, pending_ >>= 8) {
        to_[at_++] = static_cast<std::byte>(pending_ & 0xff);
      }
    }
    if (at_ < to_.size() && pending_bits_ > 0) to_[at_] = static_cast<std::byte>(pending_ & 0xff);
  }

  // Two pixels in three bytes: high bits of the first, low bits of both (always 0 here), high bits of the second.
  void pairs(std::span<const std::byte> row) {
    for (const std::byte pixel : row) {
      if (second_ && at_ < to_.size()) to_[at_++] = std::byte{0};
      if (at_ < to_.size()) to_[at_++] = pixel;
      second_ = !second_;
    }
  }

  std::span<std::byte> to_;
  std::uint32_t format_;
  std::size_t at_ = 0;
  unsigned pending_ = 0;
  unsigned pending_bits_ = 0;
  bool second_ = false;
};

}  // namespace mocap::sim
