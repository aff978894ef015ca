#pragma once

#include <ltc.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <random>
#include <vector>

#include "base/time.h"
#include "model/clock/timecode.h"

namespace mocap::timecode::testing {

inline constexpr double kSampleRate_hz = 48'000.0;
inline constexpr Timestamp kBegin = from_ns(5'000'000'000'000);  // of the first sample

using Samples = std::vector<std::int16_t>;

inline Timecode with_rate(std::uint32_t frames_per_second, bool drop_frame = false, bool fractional = false) {
  Timecode format;
  format.frames_per_second = frames_per_second;
  format.drop_frame = drop_frame;
  format.fractional = fractional;
  return format;
}

inline Timecode at(Timecode format, std::uint32_t hours, std::uint32_t minutes, std::uint32_t seconds,
                   std::uint32_t frames) {
  format.hours = hours;
  format.minutes = minutes;
  format.seconds = seconds;
  format.frames = frames;
  return format;
}

/// LTC of `frames` frames from `start` on, written by libltc's encoder. `drift`: the source is so much faster than the
/// nominal rate. `step`: -1: played backwards.
inline Samples ltc(const Timecode& start, int frames, double drift = 0.0, int step = 1) {
  LTCEncoder* encoder = ltc_encoder_create(kSampleRate_hz / (1.0 + drift), rate_hz(start), LTC_TV_1125_60, 0);
  Samples samples;
  for (int i = 0; i < frames; ++i) {
    const Timecode timecode = timecode_of(frames_of(start) + i * step, start);
    SMPTETimecode numbers{};
    numbers.hours = static_cast<unsigned char>(timecode.hours);
    numbers.mins = static_cast<unsigned char>(timecode.minutes);
    numbers.secs = static_cast<unsigned char>(timecode.seconds);
    numbers.frame = static_cast<unsigned char>(timecode.frames);
    ltc_encoder_set_timecode(encoder, &numbers);
    LTCFrame frame{};
    ltc_encoder_get_frame(encoder, &frame);
    frame.dfbit = start.drop_frame ? 1U : 0U;
    ltc_frame_set_parity(&frame, LTC_TV_1125_60);
    ltc_encoder_set_frame(encoder, &frame);
    step > 0 ? ltc_encoder_encode_frame(encoder) : ltc_encoder_encode_reversed_frame(encoder);
    ltcsnd_sample_t* bytes = nullptr;
    const int count = ltc_encoder_get_bufferptr(encoder, &bytes, 1);
    for (int n = 0; n < count; ++n) samples.push_back(static_cast<std::int16_t>((bytes[n] - 128) * 256));
  }
  ltc_encoder_free(encoder);
  return samples;
}

/// Adds white noise with a standard deviation of `share` of the full scale.
inline void add_noise(Samples& samples, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 32767.0 * share);
  for (std::int16_t& sample : samples) {
    sample = static_cast<std::int16_t>(std::clamp(sample + noise(random), -32768.0, 32767.0));
  }
}

inline void silence(Samples& samples, double begin_s, double end_s) {
  const auto first = static_cast<std::size_t>(begin_s * kSampleRate_hz);
  const auto last = static_cast<std::size_t>(end_s * kSampleRate_hz);
  for (std::size_t i = first; i < std::min(last, samples.size()); ++i) samples[i] = 0;
}

inline void append(Samples& samples, const Samples& more) { samples.insert(samples.end(), more.begin(), more.end()); }

}  // namespace mocap::timecode::testing
