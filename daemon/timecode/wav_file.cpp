#include "timecode/wav_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>

namespace mocap::timecode {
namespace {

static_assert(std::endian::native == std::endian::little, "the numbers of a WAV file are copied in memory order");

// Format codes of the chunk "fmt " (Microsoft, Multimedia Programming Interface and Data Specifications 1.0).
constexpr std::uint16_t kPcm = 1, kFloat = 3, kExtensible = 0xFFFE;
constexpr std::uint32_t kMostChannels = 64, kLeastRate_hz = 8000, kMostRate_hz = 384'000;
constexpr std::uint32_t kMostFormat_bytes = 4096;

struct Format {
  std::uint16_t code = 0, channels = 0;
  std::uint32_t rate_hz = 0;
  std::uint16_t frame_bytes = 0, bits = 0;
};

template <class Number>
Number number_at(const std::vector<char>& bytes, std::size_t at) {
  Number number{};
  std::memcpy(&number, bytes.data() + at, sizeof(number));
  return number;
}

Format format_in(const std::vector<char>& chunk) {
  Format format;
  if (chunk.size() < 16) return format;
  format.code = number_at<std::uint16_t>(chunk, 0);
  format.channels = number_at<std::uint16_t>(chunk, 2);
  format.rate_hz = number_at<std::uint32_t>(chunk, 4);
  format.frame_bytes = number_at<std::uint16_t>(chunk, 12);
  format.bits = number_at<std::uint16_t>(chunk, 14);
  if (format.code == kExtensible && chunk.size() >= 26) format.code = number_at<std::uint16_t>(chunk, 24);
  return format;
}

bool is_readable(const Format& format) {
  const bool kind = (format.code == kPcm && (format.bits == 16 || format.bits == 24 || format.bits == 32)) ||
                    (format.code == kFloat && format.bits == 32);
  return kind && format.channels >= 1 && format.channels <= kMostChannels && format.rate_hz >= kLeastRate_hz &&
         format.rate_hz <= kMostRate_hz && format.frame_bytes == format.channels * (format.bits / 8U);
}

// The sample as 16 bits. Of longer integers the upper 16 bits.
std::int16_t sample_at(const char* bytes, std::size_t size, bool is_float) {
  std::int16_t sample = 0;
  if (!is_float) {
    std::memcpy(&sample, bytes + size - sizeof(sample), sizeof(sample));
    return sample;
  }
  float value = 0.0F;
  std::memcpy(&value, bytes, sizeof(value));
  if (!std::isfinite(value)) return 0;
  return static_cast<std::int16_t>(std::lround(std::clamp(value, -1.0F, 1.0F) * 32767.0F));
}

}  // namespace

Result<WavFile> WavFile::open(const std::filesystem::path& path, int channel) {
  const auto wrong = [&](const std::string& why) {
    return Error{ErrorCode::InvalidArgument, fmt::format("'{}' {}", path.string(), why)};
  };
  WavFile wav;
  wav.file_.open(path, std::ios::binary);
  if (!wav.file_) return Error{ErrorCode::NotFound, fmt::format("'{}' cannot be read", path.string())};
  std::array<char, 12> head{};
  wav.file_.read(head.data(), head.size());
  if (!wav.file_ || std::string_view(head.data(), 4) != "RIFF" || std::string_view(head.data() + 8, 4) != "WAVE") {
    return wrong("is not a WAV file");
  }
  Format format;
  for (std::array<char, 8> chunk{}; wav.file_.read(chunk.data(), chunk.size());) {
    std::uint32_t size = 0;
    std::memcpy(&size, chunk.data() + 4, sizeof(size));
    const std::string_view name(chunk.data(), 4);
    if (name == "data") {
      if (!is_readable(format)) {
        return wrong(fmt::format(
            "has format {} with {} bits, {} channels and {} Hz; expected PCM of 16, 24 or 32 bits or floats",
            format.code, format.bits, format.channels, format.rate_hz));
      }
      if (channel < 1 || channel > format.channels) {
        return wrong(
            fmt::format("has {} channels, expected at least [timecode] channel = {}", format.channels, channel));
      }
      wav.rate_hz_ = format.rate_hz;
      wav.is_float_ = format.code == kFloat;
      wav.sample_bytes_ = format.bits / 8U;
      wav.frame_bytes_ = format.frame_bytes;
      wav.first_byte_ = static_cast<std::size_t>(channel - 1) * wav.sample_bytes_;
      wav.left_ = size / format.frame_bytes;
      return wav;
    }
    const std::uint32_t padded = size + size % 2;
    if (name == "fmt " && size <= kMostFormat_bytes) {
      std::vector<char> bytes(padded);
      wav.file_.read(bytes.data(), padded);
      format = format_in(bytes);
    } else {
      wav.file_.seekg(padded, std::ios::cur);
    }
  }
  return wrong("has no samples");
}

std::span<const std::int16_t> WavFile::read(std::size_t most) {
  const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(most, left_));
  bytes_.resize(wanted * frame_bytes_);
  file_.read(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
  samples_.resize(static_cast<std::size_t>(file_.gcount()) / frame_bytes_);
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    samples_[i] = sample_at(bytes_.data() + i * frame_bytes_ + first_byte_, sample_bytes_, is_float_);
  }
  left_ = samples_.size() < wanted ? 0 : left_ - wanted;
  return samples_;
}

}  // namespace mocap::timecode
