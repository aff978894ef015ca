#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace mocap::timecode::testing {

template <class Number>
void put(std::string& bytes, Number number) {
  char raw[sizeof(number)];
  std::memcpy(raw, &number, sizeof(number));
  bytes.append(raw, sizeof(raw));
}

/// A WAV file with the interleaved bytes `data`. `code`: 1 PCM, 3 floats.
inline std::string wav(std::uint16_t code, std::uint16_t channels, std::uint32_t rate_hz, std::uint16_t bits,
                       const std::string& data) {
  std::string bytes = "RIFF";
  put(bytes, static_cast<std::uint32_t>(36 + data.size()));
  bytes += "WAVEfmt ";
  put(bytes, std::uint32_t{16});
  put(bytes, code);
  put(bytes, channels);
  put(bytes, rate_hz);
  put(bytes, rate_hz * channels * (bits / 8U));
  put(bytes, static_cast<std::uint16_t>(channels * (bits / 8U)));
  put(bytes, bits);
  bytes += "LIST";  // a chunk that is skipped, with an odd size
  put(bytes, std::uint32_t{3});
  bytes += std::string("abc\0", 4);
  bytes += "data";
  put(bytes, static_cast<std::uint32_t>(data.size()));
  return bytes + data;
}

inline std::string wav(const std::vector<std::int16_t>& samples, std::uint32_t rate_hz = 48'000) {
  std::string data;
  for (const std::int16_t sample : samples) put(data, sample);
  return wav(1, 1, rate_hz, 16, data);
}

}  // namespace mocap::timecode::testing
