#pragma once

#include <memory>

#include "timecode/audio_source.h"
#include "timecode/timecode_settings.h"

namespace mocap::timecode {

/// Records [timecode] device by ALSA, and opens it again after a failure. Opens nothing before the first call.
std::unique_ptr<AudioSource> make_alsa_audio(const TimecodeSettings& settings);

}  // namespace mocap::timecode
