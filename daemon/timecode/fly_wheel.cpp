#include "timecode/fly_wheel.h"

#include <algorithm>
#include <cmath>

namespace mocap::timecode {
namespace {

// Standard deviation of the start of a decoded frame, in frames: 0.7 ms at 30 frames/s. Measured with libltc 1.3.2: 21
// us with 8 % noise, 0.9 ms at most with 39 % noise.
constexpr double kJitter_frames = 0.02;
// Quartz clocks differ by less than 100 ppm; tape machines and mixed-up rates of 1/1.001 by 1000 ppm.
constexpr double kFirstDeviation = 300e-6;
constexpr double kMostDeviation = 2000e-6;
// Random walk of the deviation, for each frame: 2 ppm in a second, so the filter remembers about 10 s.
constexpr double kDeviationWalk = 0.3e-6;
// A frame whose position is this far off is another frame: wrong numbers are at least one frame off, jitter is 0.03
// frames, and a coasting clock that was locked for 10 s is off by 0.01 frames in a minute.
constexpr double kGate_frames = 0.25;
// Of the frames of one candidate, from its first to its last. 24 and 25 frames/s differ by 0.16 frames in kLockFrames.
constexpr double kRunGate_frames = 0.1;
constexpr int kFramesOfARate = 10;

}  // namespace

FlyWheel::FlyWheel(const Timecode& format)
    : format_(format), rate_hz_(rate_hz(format)), deviation_variance_(kFirstDeviation * kFirstDeviation) {}

double FlyWheel::difference(double one, double other) const {
  const auto day = static_cast<double>(frames_per_day(format_));
  return std::remainder(one - other, day);
}

double FlyWheel::frames_between(Timestamp from, Timestamp to) const { return rate_hz_ * to_s(to - from); }

LtcVerdict FlyWheel::add(const LtcFrame& frame) {
  const LtcVerdict verdict = judge(frame);
  ++(verdict == LtcVerdict::Accepted ? accepted_ : rejected_);
  return verdict;
}

LtcVerdict FlyWheel::judge(const LtcFrame& frame) {
  Timecode timecode = frame.timecode;
  timecode.frames_per_second = format_.frames_per_second;
  if (frame.reverse) return LtcVerdict::Reverse;
  if (timecode.drop_frame != format_.drop_frame) return LtcVerdict::OtherCounting;
  if (!is_valid(timecode)) return LtcVerdict::Impossible;
  const std::int64_t number = frames_of(timecode);
  listen(number, frame.starts_at);
  if (agrees(number, frame.starts_at)) {
    follow(number, frame.starts_at);
    return LtcVerdict::Accepted;
  }
  if (!jump_is_sure(number, frame.starts_at)) return LtcVerdict::Disagrees;
  jump(number, frame.starts_at);
  return LtcVerdict::Accepted;
}

// Measures the rate of the signal, also if it is not the configured one.
void FlyWheel::listen(std::int64_t number, Timestamp at) {
  const bool counts_on =
      heard_.frames > 0 && number == heard_.last + 1 && at > heard_.last_at && frames_between(heard_.last_at, at) < 2.0;
  if (!counts_on) heard_ = {number, number, at, at, 0};
  heard_.last = number;
  heard_.last_at = at;
  ++heard_.frames;
}

std::optional<double> FlyWheel::heard_rate_hz() const noexcept {
  if (heard_.frames < kFramesOfARate) return std::nullopt;
  return static_cast<double>(heard_.last - heard_.first) / to_s(heard_.last_at - heard_.first_at);
}

bool FlyWheel::agrees(std::int64_t number, Timestamp at) const {
  if (!clock_ || at <= clock_->at) return false;
  const double predicted = clock_->frames_at + frames_between(clock_->at, at) * (1.0 + deviation_);
  return std::abs(difference(static_cast<double>(number), predicted)) < kGate_frames;
}

// One step of the Kalman filter with the state (position, deviation of the rate).
void FlyWheel::follow(std::int64_t number, Timestamp at) {
  const double step = frames_between(clock_->at, at);
  const double predicted = clock_->frames_at + step * (1.0 + deviation_);
  position_variance_ += 2.0 * step * covariance_ + step * step * deviation_variance_;
  covariance_ += step * deviation_variance_;
  deviation_variance_ += step * kDeviationWalk * kDeviationWalk;
  deviation_variance_ = std::min(deviation_variance_, kFirstDeviation * kFirstDeviation);

  const double innovation = difference(static_cast<double>(number), predicted);
  const double variance = position_variance_ + kJitter_frames * kJitter_frames;
  const double position_gain = position_variance_ / variance, deviation_gain = covariance_ / variance;
  deviation_ = std::clamp(deviation_ + deviation_gain * innovation, -kMostDeviation, kMostDeviation);
  deviation_variance_ -= deviation_gain * covariance_;
  covariance_ -= position_gain * covariance_;
  position_variance_ -= position_gain * position_variance_;

  clock_->at = at;
  clock_->frames_at = std::fmod(predicted + position_gain * innovation, static_cast<double>(frames_per_day(format_)));
  clock_->frames_per_s = rate_hz_ * (1.0 + deviation_);
  last_accepted_at_ = at;
  candidate_ = {};
}

// Adds a frame to the candidate, or begins another one.
bool FlyWheel::jump_is_sure(std::int64_t number, Timestamp at) {
  const bool later = candidate_.frames > 0 && frames_between(candidate_.last_at, at) > 0.5;
  const double expected = static_cast<double>(candidate_.first) + frames_between(candidate_.first_at, at);
  if (!later || std::abs(difference(static_cast<double>(number), expected)) > kRunGate_frames) {
    candidate_ = {number, number, at, at, 0};
  }
  candidate_.last = number;
  candidate_.last_at = at;
  return ++candidate_.frames >= kLockFrames;
}

// The source's quartz stays the same, so the measured deviation is kept.
void FlyWheel::jump(std::int64_t number, Timestamp at) {
  if (clock_) ++jumps_;
  clock_.emplace();
  clock_->format = format_;
  clock_->at = at;
  clock_->frames_at = static_cast<double>(number);
  clock_->frames_per_s = rate_hz_ * (1.0 + deviation_);
  position_variance_ = kJitter_frames * kJitter_frames;
  covariance_ = 0.0;
  last_accepted_at_ = at;
  candidate_ = {};
}

}  // namespace mocap::timecode
