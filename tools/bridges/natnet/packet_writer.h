#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <vector>

#include "mocap_client.h"

namespace mocap::natnet {

/// Numbers of the messages.
enum class Message : std::uint16_t {
  Connect = 0,
  ServerInfo = 1,
  Request = 2,
  Response = 3,
  RequestModels = 4,
  Models = 5,
  RequestFrame = 6,
  Frame = 7,
  Disconnect = 9,
  KeepAlive = 10,
  EchoRequest = 12,
  EchoResponse = 13,
  Discovery = 14,
  Unrecognised = 100
};

/// Writes one packet, little endian, into memory that is allocated once.
class PacketWriter {
 public:
  static constexpr std::size_t kMax_bytes = 65507;  ///< the largest payload of UDP over IPv4

  PacketWriter() : bytes_(kMax_bytes) {}

  void begin(Message message) {
    used_ = 0;
    put(static_cast<std::uint16_t>(message));
    put(std::uint16_t{0});  // written by finish()
  }

  template <class T>
  requires std::integral<T> || std::floating_point<T>
  void put(T value) {
    static_assert(std::endian::native == std::endian::little);
    put_bytes(&value, sizeof value);
  }
  void put_vec3(mocap_vec3 v) { put_bytes(&v, sizeof v); }
  void put_quat(mocap_quat q) { put_bytes(&q, sizeof q); }

  /// Writes `text` up to its first zero byte, and a zero byte.
  void put_text(std::string_view text) {
    text = text.substr(0, text.find('\0'));
    put_bytes(text.data(), text.size());
    put('\0');
  }

  /// Reserves an i32 for a number of bytes or items that is known later.
  std::size_t reserve() {
    put(std::int32_t{0});
    return used_;
  }
  /// Writes the number of bytes since reserve() returned `mark`.
  void close(std::size_t mark) { set(mark, static_cast<std::int32_t>(used_ - mark)); }
  void set(std::size_t mark, std::int32_t value) {
    if (mark <= bytes_.size() && mark >= sizeof value) std::memcpy(&bytes_[mark - sizeof value], &value, sizeof value);
  }

  /// The packet, valid until the next begin(); empty if it is larger than kMax_bytes.
  std::string_view finish() {
    if (used_ > bytes_.size()) return {};
    const auto payload = static_cast<std::uint16_t>(used_ - 4);
    std::memcpy(&bytes_[2], &payload, sizeof payload);
    return {bytes_.data(), used_};
  }

 private:
  void put_bytes(const void* from, std::size_t count) {
    if (count > 0 && used_ + count <= bytes_.size()) std::memcpy(&bytes_[used_], from, count);
    used_ += count;  // counts on beyond the end, so that finish() knows
  }

  std::vector<char> bytes_;
  std::size_t used_ = 0;
};

}  // namespace mocap::natnet
