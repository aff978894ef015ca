#pragma once

#include <cstdint>
#include <string_view>

namespace mocap::chaos {

/// A hash of bytes in their order: FNV-1a, 64 bits (Fowler, Noll, Vo).
class Hash {
 public:
  void add(std::string_view bytes) noexcept {
    for (const char byte : bytes) {
      value_ ^= static_cast<unsigned char>(byte);
      value_ *= 0x0000'0100'0000'01B3;
    }
  }
  void add(std::uint64_t number) noexcept {
    add(std::string_view(reinterpret_cast<const char*>(&number), sizeof number));
  }
  std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t value_ = 0xCBF2'9CE4'8422'2325;
};

}  // namespace mocap::chaos
