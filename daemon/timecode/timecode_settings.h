#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include "base/key_visitor.h"
#include "base/time.h"
#include "model/clock/timecode_health.h"

namespace mocap::timecode {

/// [timecode]: the timecode of the snapshots. Help and ranges of the keys: timecode_settings.cpp.
struct TimecodeSettings {
  TimecodeSourceKind source = TimecodeSourceKind::None;
  Timecode format;  ///< rate and counting
  std::string device = "default";
  std::filesystem::path wav;  ///< empty: the device
  int channel = 1;
  Duration coast = std::chrono::seconds(5);
};

void declare_keys(KeyVisitor& keys, TimecodeSettings& timecode);

/// The value of the key `rate` for a format: "29.97drop".
std::string rate_name(const Timecode& format);

}  // namespace mocap::timecode
