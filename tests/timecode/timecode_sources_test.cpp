#include "timecode/timecode_sources.h"

#include <gtest/gtest.h>

#include "ltc_signal.h"
#include "model/search_health.h"
#include "support/temporary_folder.h"
#include "wav_bytes.h"

namespace mocap::timecode {
namespace timecode_sources_test {

using testing::with_rate;

// Delivers blocks of LTC and then fails.
class Tape : public AudioSource {
 public:
  explicit Tape(testing::Samples samples) : samples_(std::move(samples)) {}
  Result<AudioBlock> next(Duration) override {
    if (at_ >= samples_.size()) return Error{ErrorCode::EndOfStream, "tape has ended"};
    const std::size_t count = std::min<std::size_t>(480, samples_.size() - at_);
    const AudioBlock block{{samples_.data() + at_, count}, now(), testing::kSampleRate_hz};
    at_ += count;
    return block;
  }
  const std::string& name() const override { return name_; }
  Timestamp now() const { return testing::kBegin + from_s(static_cast<double>(at_) / testing::kSampleRate_hz); }

 private:
  std::string name_ = "tape";
  testing::Samples samples_;
  std::size_t at_ = 0;
};

TEST(LtcSource, FollowsItsSoundAndTellsItsFailure) {
  TimecodeSettings settings;
  settings.source = TimecodeSourceKind::Ltc;
  settings.format = with_rate(25);
  auto tape = std::make_unique<Tape>(testing::ltc(testing::at(with_rate(25), 10, 0, 0, 0), 50));
  Tape& playing = *tape;
  const auto source = make_ltc_source(settings, std::move(tape), 100.0);

  for (int i = 0; i < 100; ++i) source->listen(Duration{});  // 1 s
  const TimecodeHealth locked = source->state(playing.now());
  for (int i = 0; i < 300; ++i) source->listen(Duration{});
  const TimecodeHealth ended = source->state(playing.now() + std::chrono::seconds(10));

  ASSERT_EQ(locked.state, TimecodeState::Locked);
  EXPECT_EQ(locked.clock->exposures_per_s, 100.0);
  EXPECT_EQ(ended.state, TimecodeState::Lost);
  EXPECT_NE(text_of(ended.sentence).find("tape has ended"), std::string::npos);
}

TEST(TimeOfDay, CountsFromMidnight) {
  const Timestamp now = from_ns(1'000'000'000'000);
  const Duration utc = std::chrono::hours(24) * 20'000 + std::chrono::hours(12) + std::chrono::milliseconds(500);
  const auto text = [&](const Timecode& format) {
    return text_of(*timecode_at(time_of_day(format, now, utc - now.time_since_epoch()), now));
  };

  EXPECT_EQ(text(with_rate(25)), "12:00:00:12");
  EXPECT_EQ(text(with_rate(30)), "12:00:00:15");
  EXPECT_EQ(text(with_rate(30, true)), "12:00:00;16");  // drop-frame is 1.3 frames ahead at noon
}

TEST(UtcSource, FollowsTheClockOfThisMachine) {
  TimecodeSettings settings;
  settings.source = TimecodeSourceKind::Utc;
  settings.format = with_rate(25);
  const auto source = make_timecode_source(settings, 0.0);
  const Timestamp now = host_now();
  const TimecodeHealth health = source->state(now);
  const Duration utc = (now.time_since_epoch() + utc_minus_host()) % std::chrono::hours(24);

  ASSERT_EQ(health.state, TimecodeState::Locked);
  const double position = position_at(*health.clock, now);
  EXPECT_NEAR(std::remainder(position - 25.0 * to_s(utc), 86400.0 * 25.0), 0.0, 0.5);
}

TEST(TimecodeSources, AreNoneByDefaultAndCheckTheirFile) {
  const support::TemporaryFolder folder;
  TimecodeSettings settings;
  EXPECT_EQ(make_timecode_source(settings, 0.0), nullptr);
  EXPECT_TRUE(check(settings));

  settings.source = TimecodeSourceKind::Ltc;
  settings.wav = folder.path() / "none.wav";
  EXPECT_FALSE(check(settings));
  settings.wav = folder.write("x.wav", testing::wav(std::vector<std::int16_t>(100)));
  EXPECT_TRUE(check(settings));
}

// In real time, from a file.
TEST(WavAudio, LocksAndSaysThatTheFileEnded) {
  const support::TemporaryFolder folder;
  TimecodeSettings settings;
  settings.source = TimecodeSourceKind::Ltc;
  settings.format = with_rate(25);
  settings.wav = folder.write("x.wav", testing::wav(testing::ltc(testing::at(with_rate(25), 10, 0, 0, 0), 25)));
  const auto source = make_timecode_source(settings, 0.0);
  const Timestamp begun = host_now();
  const auto listen_until = [&](const auto& holds) {
    for (const Timestamp limit = host_now() + std::chrono::seconds(60); host_now() < limit;) {
      source->listen(std::chrono::milliseconds(50));
      const TimecodeHealth health = source->state(host_now());
      if (holds(health)) return health;
    }
    return TimecodeHealth{};
  };

  const TimecodeHealth locked = listen_until([](const auto& health) { return health.clock.has_value(); });
  const TimecodeHealth ended = listen_until(
      [](const auto& health) { return text_of(health.sentence).find("has ended") != std::string_view::npos; });

  ASSERT_TRUE(locked.clock);
  // The file begins with the first call, within the time of this test.
  const double first = position_at(*locked.clock, begun) - 36000.0 * 25.0;
  EXPECT_LE(first, 0.5);
  EXPECT_GT(ended.frames, 10U);
}

}  // namespace timecode_sources_test
}  // namespace mocap::timecode
