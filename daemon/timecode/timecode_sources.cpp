#include "timecode/timecode_sources.h"

#include <thread>
#include <utility>

#include "timecode/alsa_audio.h"
#include "timecode/ltc_follower.h"
#include "timecode/wav_audio.h"
#include "timecode/wav_file.h"

namespace mocap::timecode {
namespace {

class LtcSource final : public TimecodeSource {
 public:
  LtcSource(const TimecodeSettings& settings, std::unique_ptr<AudioSource> audio, double exposures_per_s)
      : audio_(std::move(audio)), follower_(settings, audio_->name(), exposures_per_s) {}

  void listen(Duration patience) override {
    const Result<AudioBlock> block = audio_->next(patience);
    if (block) return follower_.add(*block);
    if (block.error().code != ErrorCode::Timeout) follower_.fail(block.error());
  }

  TimecodeHealth state(Timestamp now) override { return follower_.state(now); }

 private:
  std::unique_ptr<AudioSource> audio_;
  LtcFollower follower_;
};

// Steps of the system clock are followed with each call.
class UtcSource final : public TimecodeSource {
 public:
  UtcSource(const Timecode& format, double exposures_per_s) : format_(format), exposures_per_s_(exposures_per_s) {}

  void listen(Duration patience) override { std::this_thread::sleep_for(patience); }

  TimecodeHealth state(Timestamp now) override {
    TimecodeHealth health;
    health.source = TimecodeSourceKind::Utc;
    health.format = format_;
    health.state = TimecodeState::Locked;
    health.clock = time_of_day(format_, now, utc_minus_host());
    health.clock->exposures_per_s = exposures_per_s_;
    health.clock->valid_until = now + std::chrono::seconds(5);
    return health;
  }

 private:
  Timecode format_;
  double exposures_per_s_;
};

}  // namespace

TimecodeClock time_of_day(const Timecode& format, Timestamp now, Duration utc_minus_host) {
  constexpr std::chrono::hours kDay{24};
  const Duration utc = now.time_since_epoch() + utc_minus_host;
  const Duration since_midnight = (utc % kDay + kDay) % kDay;
  TimecodeClock clock;
  clock.format = format;
  clock.at = now;
  clock.frames_per_s = rate_hz(format);
  clock.frames_at = to_s(since_midnight) * clock.frames_per_s;
  return clock;
}

std::unique_ptr<TimecodeSource> make_ltc_source(const TimecodeSettings& settings, std::unique_ptr<AudioSource> audio,
                                                double exposures_per_s) {
  return std::make_unique<LtcSource>(settings, std::move(audio), exposures_per_s);
}

std::unique_ptr<TimecodeSource> make_timecode_source(const TimecodeSettings& settings, double exposures_per_s) {
  switch (settings.source) {
    case TimecodeSourceKind::None: return nullptr;
    case TimecodeSourceKind::Utc: return std::make_unique<UtcSource>(settings.format, exposures_per_s);
    case TimecodeSourceKind::Ltc: break;
  }
  std::unique_ptr<AudioSource> audio = settings.wav.empty() ? make_alsa_audio(settings) : make_wav_audio(settings);
  return make_ltc_source(settings, std::move(audio), exposures_per_s);
}

Status check(const TimecodeSettings& settings) {
  if (settings.source != TimecodeSourceKind::Ltc || settings.wav.empty()) return {};
  const Result<WavFile> file = WavFile::open(settings.wav, settings.channel);
  return file ? Status{} : Status{file.error()};
}

}  // namespace mocap::timecode
