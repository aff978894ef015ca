#pragma once

#include <random>
#include <string>

namespace mocap::fuzz {

inline std::string random_bytes(std::mt19937_64& random) {
  std::string bytes(random() % 300, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

/// The bytes with up to three damages: a byte or a bit changed, cut off, or bytes inserted.
inline std::string damaged(std::string bytes, std::mt19937_64& random) {
  for (auto i = random() % 4; i > 0 && !bytes.empty(); --i) {
    const auto at = random() % bytes.size();
    switch (random() % 4) {
      case 0: bytes[at] = static_cast<char>(random()); break;
      case 1: bytes.resize(at); break;
      case 2: bytes.insert(at, random_bytes(random)); break;
      default: bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random() % 8)));
    }
  }
  return bytes;
}

}  // namespace mocap::fuzz
