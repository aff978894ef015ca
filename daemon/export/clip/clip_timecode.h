#pragma once

#include "export/clip/clip.h"

namespace mocap::exports {

/// The timecode at a time after the clip's first frame, counted on at the real rate of the timecode (`rate_hz`): the
/// nominal one, or 1000/1001 of it if the recorded timecode says so. Requires a first timecode with a valid rate.
Timecode timecode_at(const Clip& clip, double time_s) noexcept;

}  // namespace mocap::exports
