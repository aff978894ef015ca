#include "model/clock/timecode.h"

#include <fmt/core.h>

#include <cstdio>

namespace mocap {
namespace {

constexpr std::uint32_t kMostFramesPerSecond = 240;

// Drop-frame timecode skips the first two frame numbers of each minute but every tenth, four at 60 frames per second.
std::int64_t dropped_per_minute(const Timecode& like) noexcept {
  return like.drop_frame ? like.frames_per_second / 15 : 0;
}

}  // namespace

bool is_valid(const Timecode& t) noexcept {
  if (t.hours > 23 || t.minutes > 59 || t.seconds > 59) return false;
  if (t.frames_per_second == 0 || t.frames_per_second > kMostFramesPerSecond || t.frames >= t.frames_per_second) {
    return false;
  }
  return t.seconds != 0 || t.minutes % 10 == 0 || t.frames >= dropped_per_minute(t);
}

std::int64_t frames_per_day(const Timecode& like) noexcept {
  return 86400 * std::int64_t{like.frames_per_second} - 24 * 54 * dropped_per_minute(like);
}

std::int64_t frames_of(const Timecode& t) noexcept {
  const std::int64_t minutes = 60 * std::int64_t{t.hours} + t.minutes;
  const std::int64_t numbered = (60 * minutes + t.seconds) * t.frames_per_second + t.frames;
  return numbered - dropped_per_minute(t) * (minutes - minutes / 10);
}

Timecode timecode_of(std::int64_t frames, const Timecode& like) noexcept {
  const std::int64_t day = frames_per_day(like), dropped = dropped_per_minute(like);
  const std::int64_t fps = like.frames_per_second;
  std::int64_t number = day > 0 ? (frames % day + day) % day : 0;
  // Adds the dropped numbers of the whole blocks of ten minutes, and of the minutes of the last block.
  const std::int64_t per_ten = 600 * fps - 9 * dropped, tens = per_ten > 0 ? number / per_ten : 0;
  const std::int64_t rest = number - tens * per_ten, per_minute = 60 * fps - dropped;
  if (dropped > 0)
    number += 9 * dropped * tens + (rest < 60 * fps ? 0 : dropped * ((rest - 60 * fps) / per_minute + 1));
  Timecode t = like;
  t.subframe = 0;
  if (fps == 0) return t;
  t.frames = static_cast<std::uint32_t>(number % fps);
  const std::int64_t seconds = number / fps;
  t.seconds = static_cast<std::uint32_t>(seconds % 60);
  t.minutes = static_cast<std::uint32_t>(seconds / 60 % 60);
  t.hours = static_cast<std::uint32_t>(seconds / 3600);
  return t;
}

double rate_hz(const Timecode& timecode) noexcept {
  return timecode.frames_per_second * (timecode.drop_frame || timecode.fractional ? 1000.0 / 1001.0 : 1.0);
}

std::string text_of(const Timecode& t) {
  return fmt::format("{:02}:{:02}:{:02}{}{:02}", t.hours, t.minutes, t.seconds, t.drop_frame ? ';' : ':', t.frames);
}

std::optional<Timecode> parse_timecode(std::string_view text, const Timecode& like) {
  Timecode t = like;
  t.subframe = 0;
  char between = 0, more = 0;
  const std::string copy(text);
  if (std::sscanf(copy.c_str(), "%2u:%2u:%2u%c%2u%c", &t.hours, &t.minutes, &t.seconds, &between, &t.frames, &more) !=
      5) {
    return std::nullopt;
  }
  const bool fits = t.hours < 24 && t.minutes < 60 && t.seconds < 60 && t.frames < t.frames_per_second;
  if (!fits || (between != ':' && between != ';' && between != '.')) return std::nullopt;
  return t;
}

}  // namespace mocap
