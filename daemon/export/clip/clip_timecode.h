#pragma once

#include "export/clip/clip.h"

namespace mocap::exports {

/// The timecode at a time after the clip's first frame, counted on at the nominal rate. Requires a first timecode with
/// a valid rate.
Timecode timecode_at(const Clip& clip, double time_s) noexcept;

}  // namespace mocap::exports
