#include "timecode/timecode_settings.h"

#include <algorithm>
#include <array>
#include <utility>

namespace mocap::timecode {
namespace {

Timecode format_of(std::uint32_t frames_per_second, bool drop_frame, bool fractional) {
  Timecode format;
  format.frames_per_second = frames_per_second;
  format.drop_frame = drop_frame;
  format.fractional = fractional;
  return format;
}

struct NamedRate {
  std::string_view name;
  Timecode format;
};

const std::array<NamedRate, 6>& rates() {
  static const std::array<NamedRate, 6> kRates{{{"23.976", format_of(24, false, true)},
                                                {"24", format_of(24, false, false)},
                                                {"25", format_of(25, false, false)},
                                                {"29.97", format_of(30, false, true)},
                                                {"29.97drop", format_of(30, true, true)},
                                                {"30", format_of(30, false, false)}}};
  return kRates;
}

}  // namespace

void declare_keys(KeyVisitor& keys, TimecodeSettings& timecode) {
  keys.choice<TimecodeSourceKind>(
      "source", timecode.source,
      {{"none", TimecodeSourceKind::None}, {"ltc", TimecodeSourceKind::Ltc}, {"utc", TimecodeSourceKind::Utc}},
      {.help = "ltc: a signal on a sound device; utc: the time of day of this machine, UTC"});
  std::string rate = rate_name(timecode.format);
  std::vector<std::string_view> names;
  for (const NamedRate& each : rates()) names.push_back(each.name);
  keys.one_of("rate", rate, std::move(names), {.help = "frames per second; LTC itself does not say its rate"});
  for (const NamedRate& each : rates()) {
    if (each.name == rate) timecode.format = each.format;
  }
  keys.text("device", timecode.device, {.help = "ltc: sound device as ALSA names it (arecord -L), such as \"hw:1\""});
  keys.path(
      "wav", timecode.wav,
      {.help = "ltc: a WAV file, played once in real time instead of the device, for tests", .example = "ltc.wav"});
  keys.number("channel", timecode.channel, {1, 64}, {.help = "ltc: channel of the device or the file, from 1"});
  keys.time("coast_s", timecode.coast, {0.1, 86400},
            {.help = "ltc: the timecode goes on so long without a signal, at the rate that was measured"});
}

std::string rate_name(const Timecode& format) {
  const auto found = std::ranges::find_if(rates(), [&](const NamedRate& rate) {
    return rate.format.frames_per_second == format.frames_per_second && rate.format.drop_frame == format.drop_frame &&
           rate.format.fractional == format.fractional;
  });
  return std::string(found == rates().end() ? rates().back().name : found->name);
}

}  // namespace mocap::timecode
