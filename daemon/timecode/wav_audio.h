#pragma once

#include <memory>

#include "timecode/audio_source.h"
#include "timecode/timecode_settings.h"

namespace mocap::timecode {

/// Plays [timecode] wav once, in real time from the first call on.
std::unique_ptr<AudioSource> make_wav_audio(const TimecodeSettings& settings);

}  // namespace mocap::timecode
