#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

#include "base/result.h"

namespace mocap::timecode {

/// Reads one channel of a WAV file, piece by piece: PCM of 16, 24 or 32 bits, or 32-bit floats.
class WavFile {
 public:
  /// `channel`: from 1. Fails with NotFound, or with InvalidArgument if the file has another format or fewer channels.
  static Result<WavFile> open(const std::filesystem::path& path, int channel);

  double rate_hz() const noexcept { return rate_hz_; }

  /// The next samples, `most` of them or, at the end, fewer; valid until the next call.
  std::span<const std::int16_t> read(std::size_t most);

 private:
  WavFile() = default;

  std::ifstream file_;
  double rate_hz_ = 0.0;
  bool is_float_ = false;
  std::size_t sample_bytes_ = 0, frame_bytes_ = 0, first_byte_ = 0;
  std::uint64_t left_ = 0;  // samples of one channel
  std::vector<char> bytes_;
  std::vector<std::int16_t> samples_;
};

}  // namespace mocap::timecode
