#include "timecode/ltc_decoder.h"

#include <gtest/gtest.h>

#include "ltc_signal.h"

namespace mocap::timecode {
namespace ltc_decoder_test {

using testing::at;
using testing::kBegin;
using testing::kSampleRate_hz;
using testing::Samples;
using testing::with_rate;

// Decodes in blocks of `block` samples.
std::vector<LtcFrame> decode(const Samples& samples, double frames_per_second, std::size_t block = 480) {
  LtcDecoder decoder(frames_per_second);
  std::vector<LtcFrame> all;
  for (std::size_t i = 0; i < samples.size(); i += block) {
    const std::span<const std::int16_t> part(samples.data() + i, std::min(block, samples.size() - i));
    for (const LtcFrame& frame :
         decoder.decode({part, kBegin + from_s(static_cast<double>(i) / kSampleRate_hz), kSampleRate_hz})) {
      all.push_back(frame);
    }
  }
  return all;
}

TEST(LtcDecoder, FindsFramesAndTheirStartsAtEveryRate) {
  for (const Timecode& format : {with_rate(24), with_rate(24, false, true), with_rate(25), with_rate(30, false, true),
                                 with_rate(30, true), with_rate(30)}) {
    const Timecode start = at(format, 1, 0, 58, 0);
    const std::vector<LtcFrame> frames = decode(testing::ltc(start, 120), rate_hz(format));

    ASSERT_GE(frames.size(), 117U) << rate_hz(format);
    const std::int64_t first = frames_of(start);
    for (LtcFrame frame : frames) {
      frame.timecode.frames_per_second = format.frames_per_second;
      EXPECT_EQ(frame.timecode.drop_frame, format.drop_frame);
      const double starts_s = static_cast<double>(frames_of(frame.timecode) - first) / rate_hz(format);
      EXPECT_NEAR(to_s(frame.starts_at - kBegin), starts_s, 100e-6) << text_of(frame.timecode);
    }
  }
}

TEST(LtcDecoder, GivesTheSameFramesForAnyBlocks) {
  const Samples samples = testing::ltc(at(with_rate(25), 10, 0, 0, 0), 100);
  const std::vector<LtcFrame> small = decode(samples, 25.0, 100), whole = decode(samples, 25.0, samples.size());

  ASSERT_EQ(small.size(), whole.size());
  for (std::size_t i = 0; i < small.size(); ++i) {
    EXPECT_EQ(small[i].timecode, whole[i].timecode);
    EXPECT_NEAR(to_s(small[i].starts_at - whole[i].starts_at), 0.0, 25e-6);
  }
}

TEST(LtcDecoder, KnowsFramesThatArePlayedBackwards) {
  const std::vector<LtcFrame> frames = decode(testing::ltc(at(with_rate(25), 10, 0, 10, 0), 100, 0.0, -1), 25.0);

  ASSERT_GT(frames.size(), 90U);
  EXPECT_TRUE(std::ranges::all_of(frames, &LtcFrame::reverse));
}

TEST(LtcDecoder, SurvivesNoiseAndEmptyBlocks) {
  Samples noise(480'000, 0);
  testing::add_noise(noise, 0.5, 3);
  decode(noise, 30.0, 4801);

  LtcDecoder decoder(25.0);
  EXPECT_TRUE(decoder.decode({{}, kBegin, kSampleRate_hz}).empty());
  EXPECT_TRUE(decoder.decode({noise, kBegin, 0.0}).empty());
}

}  // namespace ltc_decoder_test
}  // namespace mocap::timecode
