#include "timecode/ltc_follower.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/search_health.h"

namespace mocap::timecode {
namespace {

// Without an accepted frame for so long the signal is interrupted: 12 frames at 24 frames/s.
constexpr Duration kInterrupted = std::chrono::milliseconds(500);
// The peak decays to 1 % in 2 s.
constexpr double kPeakDecay_per_s = 2.3;
// Line level is above 10 %; below 1 % libltc reads noise.
constexpr double kQuiet = 0.01;
// Two quartz clocks differ by less; 29.97 instead of 30 frames/s is 1000 ppm.
constexpr double kOtherRate_ppm = 600.0;
constexpr double kOtherRate = 0.003;

double peak_of(std::span<const std::int16_t> samples) {
  double most = 0.0;
  for (const std::int16_t sample : samples) most = std::max(most, std::abs(sample / 32768.0));
  return most;
}

std::string seconds_text(Duration span) { return fmt::format("{:.1f} s", to_s(span)); }

}  // namespace

LtcFollower::LtcFollower(const TimecodeSettings& settings, std::string name, double exposures_per_s)
    : settings_(settings),
      name_(std::move(name)),
      exposures_per_s_(exposures_per_s),
      decoder_(rate_hz(settings.format)),
      wheel_(settings.format) {}

void LtcFollower::add(const AudioBlock& block) {
  if (block.samples.empty() || !(block.rate_hz > 0.0)) return;
  failure_.clear();
  last_block_at_ = block.first_at;
  const double block_s = static_cast<double>(block.samples.size()) / block.rate_hz;
  peak_ = std::max(peak_ * std::exp(-kPeakDecay_per_s * block_s), peak_of(block.samples));
  for (const LtcFrame& frame : decoder_.decode(block)) {
    heard_ = wheel_.add(frame);
    heard_at_ = frame.starts_at;
  }
}

TimecodeHealth LtcFollower::state(Timestamp now) const {
  TimecodeHealth health;
  health.source = TimecodeSourceKind::Ltc;
  health.format = settings_.format;
  health.last_frame_at = wheel_.last_accepted_at();
  health.drift_ppm = wheel_.drift_ppm();
  health.frames = wheel_.accepted();
  health.rejected_frames = wheel_.rejected();
  health.jumps = wheel_.jumps();
  health.clock = wheel_.clock();
  if (health.clock) {
    health.clock->valid_until = *health.last_frame_at + settings_.coast;
    health.clock->exposures_per_s = exposures_per_s_;
    const Duration age = now - *health.last_frame_at;
    health.state = age <= kInterrupted      ? TimecodeState::Locked
                   : age <= settings_.coast ? TimecodeState::Coasting
                                            : TimecodeState::Lost;
  }
  health.sentence = bounded_text<255>(cause(now));
  return health;
}

// Empty: locked, and the rate is plausible.
std::string LtcFollower::cause(Timestamp now) const {
  const auto last = wheel_.last_accepted_at();
  const Duration age = last ? now - *last : Duration::max();
  if (age <= kInterrupted) {
    if (std::abs(wheel_.drift_ppm()) < kOtherRate_ppm) return {};
    return fmt::format("the LTC of {} is {:.0f} ppm {}; check [timecode] rate = \"{}\"", name_,
                       std::abs(wheel_.drift_ppm()), wheel_.drift_ppm() > 0.0 ? "fast" : "slow",
                       rate_name(settings_.format));
  }
  const std::string what = !last                    ? "no timecode"
                           : age <= settings_.coast ? "the timecode goes on without a signal"
                                                    : "no timecode";
  const std::string since = last ? fmt::format(" for {}", seconds_text(age)) : std::string();
  std::string why = cause_in_signal();
  if (failure_.empty() && !why.empty() && last_block_at_ && now - *last_block_at_ > std::chrono::seconds(1)) {
    why = fmt::format("{} delivers no sound", name_);
  }
  return fmt::format("{}{} because {}", what, since, why);
}

std::string LtcFollower::cause_in_signal() const {
  if (!failure_.empty()) return failure_;
  if (!last_block_at_) return fmt::format("{} delivered no sound yet", name_);
  if (peak_ < kQuiet) {
    return fmt::format("{} is silent on channel {}: check cable, level and [timecode] channel", name_,
                       settings_.channel);
  }
  const bool fresh = heard_at_ && *last_block_at_ - *heard_at_ < std::chrono::seconds(1);
  if (!fresh) {
    return fmt::format("the sound of {} on channel {} (peak {:.0f} %) is no LTC: check the source and the level", name_,
                       settings_.channel, 100.0 * peak_);
  }
  const std::string rate = rate_name(settings_.format);
  switch (heard_) {
    case LtcVerdict::Reverse: return fmt::format("the LTC of {} runs backwards: play it forwards", name_);
    case LtcVerdict::OtherCounting:
      return fmt::format("the LTC of {} is {}, but [timecode] rate is \"{}\"; set {}", name_,
                         settings_.format.drop_frame ? "not drop-frame" : "drop-frame", rate,
                         settings_.format.drop_frame ? "\"29.97\" or \"30\"" : "\"29.97drop\"");
    default: break;
  }
  const auto heard_hz = wheel_.heard_rate_hz();
  if (heard_hz && std::abs(*heard_hz / rate_hz(settings_.format) - 1.0) > kOtherRate) {
    return fmt::format("the LTC of {} has {:.2f} frames/s, but [timecode] rate is \"{}\"", name_, *heard_hz, rate);
  }
  return fmt::format("the LTC frames of {} do not count on: check level and noise (peak {:.0f} %)", name_,
                     100.0 * peak_);
}

}  // namespace mocap::timecode
