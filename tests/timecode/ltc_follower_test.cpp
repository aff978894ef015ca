#include "timecode/ltc_follower.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ltc_signal.h"
#include "model/search_health.h"

namespace mocap::timecode {
namespace ltc_follower_test {

using testing::at;
using ::testing::HasSubstr;
using testing::kBegin;
using testing::kSampleRate_hz;
using testing::Samples;
using testing::with_rate;

constexpr std::size_t kBlock = 480;

// A source with a known timecode at each instant: frame `start` at the first sample.
struct Truth {
  Timecode start;
  double drift = 0.0;

  double position(double after_s) const {
    return static_cast<double>(frames_of(start)) + after_s * rate_hz(start) * (1.0 + drift);
  }
};

class Following {
 public:
  explicit Following(const Timecode& format, double exposures_per_s = 0.0)
      : follower_(settings(format), "file 'x.wav'", exposures_per_s) {}

  static TimecodeSettings settings(const Timecode& format) {
    TimecodeSettings settings;
    settings.source = TimecodeSourceKind::Ltc;
    settings.format = with_rate(format.frames_per_second, format.drop_frame, format.fractional);
    return settings;
  }

  // Adds samples; calls `check(now_s, health)` after each block.
  template <class Check>
  void play(const Samples& samples, const Check& check) {
    for (std::size_t i = 0; i < samples.size(); i += kBlock) {
      const std::span<const std::int16_t> part(samples.data() + i, std::min(kBlock, samples.size() - i));
      follower_.add({part, kBegin + from_s(static_cast<double>(samples_) / kSampleRate_hz), kSampleRate_hz});
      samples_ += part.size();
      check(now_s(), health());
    }
  }
  void play(const Samples& samples) {
    play(samples, [](double, const TimecodeHealth&) {});
  }

  LtcFollower& follower() { return follower_; }
  double now_s() const { return static_cast<double>(samples_) / kSampleRate_hz; }
  TimecodeHealth health() const { return follower_.state(kBegin + from_s(now_s())); }
  std::string sentence() const { return std::string(text_of(health().sentence)); }

 private:
  LtcFollower follower_;
  std::size_t samples_ = 0;
};

// Frames by which the timecode now is wrong.
double error_frames(const TimecodeHealth& health, const Truth& truth, double now_s) {
  const auto day = static_cast<double>(frames_per_day(truth.start));
  return std::remainder(position_at(*health.clock, kBegin + from_s(now_s)) - truth.position(now_s), day);
}

class EveryRate : public ::testing::TestWithParam<Timecode> {};

// Drift, noise, and a minute at which drop-frame skips numbers.
TEST_P(EveryRate, IsFollowedWithin200PpmAndNoise) {
  const Truth truth{at(GetParam(), 1, 0, 55, 0), 200e-6};
  Samples samples = testing::ltc(truth.start, 600, truth.drift);
  testing::add_noise(samples, 0.08, 5);
  Following following(truth.start);
  int locked = 0;
  following.play(samples, [&](double now_s, const TimecodeHealth& health) {
    if (health.state != TimecodeState::Locked) return;
    ++locked;
    ASSERT_LT(std::abs(error_frames(health, truth, now_s)), 0.03) << now_s;  // 1 ms at 30 frames/s
  });

  EXPECT_GT(locked, 1900 * 600 / 30 / 25);
  EXPECT_EQ(following.health().jumps, 0U);
  EXPECT_NEAR(following.health().drift_ppm, 200.0, 60.0);
  EXPECT_EQ(following.sentence(), "");
}

TEST_P(EveryRate, PassesMidnight) {
  const Truth truth{timecode_of(-50, GetParam())};
  Following following(truth.start);
  following.play(testing::ltc(truth.start, 100), [&](double now_s, const TimecodeHealth& health) {
    if (health.state == TimecodeState::Locked) {
      ASSERT_LT(std::abs(error_frames(health, truth, now_s)), 0.03) << now_s;
    }
  });

  EXPECT_EQ(following.health().jumps, 0U);
  EXPECT_EQ(following.health().clock ? position_at(*following.health().clock, kBegin + from_s(following.now_s())) > 40.0
                                     : false,
            true);
}

INSTANTIATE_TEST_SUITE_P(Ltc, EveryRate,
                         ::testing::Values(with_rate(24), with_rate(24, false, true), with_rate(25),
                                           with_rate(30, false, true), with_rate(30, true), with_rate(30)));

TEST(LtcFollower, CoastsThroughDropouts) {
  const Truth truth{at(with_rate(25), 10, 0, 0, 0), 100e-6};
  Samples samples = testing::ltc(truth.start, 25 * 30, truth.drift);
  testing::silence(samples, 10.0, 13.0);
  testing::silence(samples, 20.0, 20.2);
  Following following(truth.start);
  int coasting = 0;
  following.play(samples, [&](double now_s, const TimecodeHealth& health) {
    if (health.state == TimecodeState::Coasting) ++coasting;
    if (now_s > 1.0) {
      ASSERT_TRUE(timecode_at(*health.clock, kBegin + from_s(now_s))) << now_s;
      ASSERT_LT(std::abs(error_frames(health, truth, now_s)), 0.05) << now_s;
    }
  });

  EXPECT_NEAR(coasting, 260, 20);  // of the first dropout, after 0.5 s
  EXPECT_EQ(following.health().jumps, 0U);
}

TEST(LtcFollower, StrongNoiseGivesNoWrongTimecode) {
  const Truth truth{at(with_rate(30), 10, 0, 0, 0)};
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Samples samples = testing::ltc(truth.start, 30 * 20);
    testing::add_noise(samples, 0.22, seed);
    Following following(truth.start);
    following.play(samples, [&](double now_s, const TimecodeHealth& health) {
      if (health.clock) {
        ASSERT_LT(std::abs(error_frames(health, truth, now_s)), 0.1) << now_s;
      }
    });
    EXPECT_EQ(following.health().state, TimecodeState::Locked) << seed;
  }
}

TEST(LtcFollower, FollowsAJumpOfTheSource) {
  Samples samples = testing::ltc(at(with_rate(25), 10, 0, 0, 0), 100);
  testing::append(samples, testing::ltc(at(with_rate(25), 23, 0, 0, 0), 50));
  Following following(with_rate(25));
  following.play(samples);

  EXPECT_EQ(following.health().jumps, 1U);
  EXPECT_EQ(text_of(*timecode_at(*following.health().clock, kBegin + from_s(following.now_s() - 0.02))), "23:00:01:24");
}

TEST(LtcFollower, CountsSubframesOfTheCameras) {
  Following following(with_rate(30), 120.0);
  following.play(testing::ltc(at(with_rate(30), 10, 0, 0, 0), 60));
  const TimecodeClock clock = *following.health().clock;
  const auto exposure = [&](double after_s) { return *timecode_at(clock, kBegin + from_s(after_s)); };

  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(text_of(exposure(1.002 + i / 120.0)), "10:00:01:00");
    EXPECT_EQ(exposure(1.002 + i / 120.0).subframe, static_cast<std::uint32_t>(i));
  }
}

TEST(LtcFollower, SaysThatTheSignalEnded) {
  Following following(with_rate(25));
  following.play(testing::ltc(at(with_rate(25), 10, 0, 0, 0), 100));
  EXPECT_EQ(following.health().state, TimecodeState::Locked);
  following.follower().fail({ErrorCode::EndOfStream, "file 'x.wav' has ended"});
  const Timestamp end = kBegin + from_s(following.now_s());
  const auto after = [&](int seconds) { return following.follower().state(end + std::chrono::seconds(seconds)); };

  EXPECT_EQ(after(2).state, TimecodeState::Coasting);
  EXPECT_TRUE(timecode_at(*after(2).clock, end + std::chrono::seconds(2)));
  EXPECT_EQ(after(7).state, TimecodeState::Lost);
  EXPECT_FALSE(timecode_at(*after(7).clock, end + std::chrono::seconds(7)));
  EXPECT_NEAR(to_s(end + std::chrono::seconds(7) - *after(7).last_frame_at), 7.06, 0.05);
  EXPECT_THAT(std::string(text_of(after(7).sentence)),
              ::testing::MatchesRegex("no timecode for 7\\.[01] s because file 'x.wav' has ended"));
}

TEST(LtcFollower, SaysWhyThereIsNoTimecode) {
  const auto sentence = [](const Timecode& format, const Samples& samples) {
    Following following(format);
    following.play(samples);
    EXPECT_FALSE(following.health().clock);
    return following.sentence();
  };
  const Timecode start = at(with_rate(25), 10, 0, 0, 0);
  Samples noise(96'000, 0);
  testing::add_noise(noise, 0.2, 9);

  EXPECT_THAT(sentence(start, {}), HasSubstr("no timecode because file 'x.wav' delivered no sound yet"));
  EXPECT_THAT(sentence(start, Samples(96'000, 0)), HasSubstr("is silent on channel 1"));
  EXPECT_THAT(sentence(start, noise), HasSubstr("is no LTC"));
  EXPECT_THAT(sentence(start, testing::ltc(start, 100, 0.0, -1)), HasSubstr("runs backwards"));
  EXPECT_THAT(sentence(start, testing::ltc(at(with_rate(30), 10, 0, 0, 0), 80)),
              HasSubstr("has 30.00 frames/s, but [timecode] rate is \"25\""));
  EXPECT_THAT(sentence(with_rate(30, false, true), testing::ltc(at(with_rate(30, true), 10, 0, 0, 0), 80)),
              HasSubstr("is drop-frame, but [timecode] rate is \"29.97\"; set \"29.97drop\""));
}

TEST(LtcFollower, SaysThatTheRateIsProbablyAnother) {
  Following following(with_rate(30));
  following.play(testing::ltc(at(with_rate(30, false, true), 10, 0, 0, 0), 30 * 30));

  EXPECT_EQ(following.health().state, TimecodeState::Locked);
  EXPECT_THAT(following.sentence(), HasSubstr("ppm slow; check [timecode] rate = \"30\""));
}

TEST(LtcFollower, SurvivesGarbage) {
  std::mt19937 random(23);
  Following following(with_rate(30, true));
  Samples samples = testing::ltc(at(with_rate(30, true), 10, 0, 0, 0), 300);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i / 4800 % 3 == 1) samples[i] = static_cast<std::int16_t>(random());
  }
  following.play(samples, [](double, const TimecodeHealth& health) {
    if (health.clock) {
      ASSERT_TRUE(std::isfinite(health.clock->frames_at));
    }
  });
}

}  // namespace ltc_follower_test
}  // namespace mocap::timecode
