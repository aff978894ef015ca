#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mocap {

/// SMPTE timecode (ST 12-1) of one frame, and the exposure within it.
struct Timecode {
  std::uint32_t hours = 0, minutes = 0, seconds = 0, frames = 0;
  std::uint32_t frames_per_second = 30;  ///< nominal
  bool drop_frame = false;               ///< frame numbers are skipped to match 29.97 Hz
  bool fractional = false;               ///< the real rate is 1000/1001 of the nominal one; drop_frame implies it
  std::uint32_t subframe = 0;            ///< exposures since the start of the frame: 0 to 3 for 120 Hz at 30 frames/s

  friend bool operator==(const Timecode&, const Timecode&) = default;
};

/// Whether every number is in its range, and the frame number is not one that drop-frame timecode skips.
bool is_valid(const Timecode& timecode) noexcept;

/// Number of timecode frames since midnight, without the subframe.
std::int64_t frames_of(const Timecode& timecode) noexcept;

/// The timecode `frames` timecode frames after midnight, with the rate of `like` and subframe 0. Wraps around at
/// midnight.
Timecode timecode_of(std::int64_t frames, const Timecode& like) noexcept;

std::int64_t frames_per_day(const Timecode& like) noexcept;

/// Real frames per second: 1000/1001 of the nominal number if drop-frame or fractional.
double rate_hz(const Timecode& timecode) noexcept;

/// "01:02:03:04", or "01:02:03;04" if drop-frame.
std::string text_of(const Timecode& timecode);

/// Reads a text of `text_of`, with the rate of `like`; empty if the text is not a timecode of that rate.
std::optional<Timecode> parse_timecode(std::string_view text, const Timecode& like);

}  // namespace mocap
