#include "export/clip/clip_timecode.h"

#include <cmath>

namespace mocap::exports {
namespace {

constexpr double kRounding_frames = 1e-4;

}  // namespace

Timecode timecode_at(const Clip& clip, double time_s) noexcept {
  const Timecode& first = *clip.first_timecode;
  const double rate = rate_hz(first);
  const double exposures = clip.rate.hz() / rate;  // in a timecode frame
  const double passed = first.subframe / exposures + time_s * rate + kRounding_frames;
  const double whole = std::floor(passed);
  Timecode timecode = timecode_of(frames_of(first) + static_cast<std::int64_t>(whole), first);
  if (exposures > 1.0) timecode.subframe = static_cast<std::uint32_t>((passed - whole) * exposures);
  return timecode;
}

}  // namespace mocap::exports
