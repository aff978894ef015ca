#pragma once

#include <memory>

#include "base/result.h"
#include "module/timecode_source.h"
#include "timecode/audio_source.h"
#include "timecode/timecode_settings.h"

namespace mocap::timecode {

/// Makes the source of timecode; null: none. Opens nothing. `exposures_per_s`: of the cameras, 0: unknown.
std::unique_ptr<TimecodeSource> make_timecode_source(const TimecodeSettings& settings, double exposures_per_s);

/// LTC in the sound of `audio`.
std::unique_ptr<TimecodeSource> make_ltc_source(const TimecodeSettings& settings, std::unique_ptr<AudioSource> audio,
                                                double exposures_per_s);

/// The time of day of a clock whose time is `utc_minus_host` ahead of the host's, counted from midnight on at the real
/// rate. At 29.97 and 23.976 frames/s a day has no whole number of frames, so the count begins anew at midnight.
TimecodeClock time_of_day(const Timecode& format, Timestamp now, Duration utc_minus_host);

/// Fails if the source cannot work: a WAV file that cannot be read.
Status check(const TimecodeSettings& settings);

}  // namespace mocap::timecode
