#include "model/clock/timecode_clock.h"

#include <algorithm>
#include <cmath>

namespace mocap {
namespace {

// Of the exposure period. Cameras with one trigger expose within 1 % of a period at 120 Hz (100 us).
constexpr double kEarly = 0.1;

double wrapped(double frames, const Timecode& format) noexcept {
  const auto day = static_cast<double>(frames_per_day(format));
  if (day <= 0.0) return 0.0;
  const double rest = std::fmod(frames, day);
  return rest < 0.0 ? std::min(rest + day, std::nextafter(day, 0.0)) : rest;
}

double exposures_per_frame(const TimecodeClock& clock) noexcept {
  return clock.frames_per_s > 0.0 ? clock.exposures_per_s / clock.frames_per_s : 0.0;
}

}  // namespace

double position_at(const TimecodeClock& clock, Timestamp at) noexcept {
  return wrapped(clock.frames_at + clock.frames_per_s * to_s(at - clock.at), clock.format);
}

std::optional<Timecode> timecode_at(const TimecodeClock& clock, Timestamp at) noexcept {
  if (at > clock.valid_until) return std::nullopt;
  const double exposures = exposures_per_frame(clock);
  const double early = exposures > 1.0 ? kEarly / exposures : kEarly;
  const double position = wrapped(position_at(clock, at) + early, clock.format);
  const double whole = std::floor(position);
  Timecode timecode = timecode_of(static_cast<std::int64_t>(whole), clock.format);
  if (exposures > 1.0) timecode.subframe = static_cast<std::uint32_t>((position - whole) * exposures);
  return timecode;
}

Timestamp time_of(const TimecodeClock& clock, const Timecode& wanted, Timestamp now) noexcept {
  if (!(clock.frames_per_s > 0.0)) return Timestamp::max();
  const double ahead = wrapped(static_cast<double>(frames_of(wanted)) - position_at(clock, now), clock.format);
  return now + from_s(ahead / clock.frames_per_s);
}

}  // namespace mocap
