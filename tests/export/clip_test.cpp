#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "export/clip/clip_builder.h"
#include "export/clip/clip_timecode.h"
#include "export/clip/edit_clip.h"
#include "export/clip/rates.h"
#include "export/sample_clip.h"
#include "model/clock/timecode.h"

namespace mocap::exports {
namespace clip_test {

using ::testing::HasSubstr;
using testing::path_m;

// A recording of one subject with two markers and a bone, set by set.
class Recording {
 public:
  explicit Recording(double rate_hz, std::vector<std::string> subjects = {}) : builder_("take", std::move(subjects)) {
    description_.nominal_rate_hz = rate_hz;
    CameraModel camera;
    camera.lens.fx_px = camera.lens.fy_px = 1000.0;
    camera.camera_from_world.translation = {0.0, 0.0, 2.0};  // 2 m below the origin
    description_.cameras = {camera};
    description_.subjects = {testing::sample_subject("anna", 0, 2, 0).subject};
  }

  Description& description() { return description_; }
  ClipBuilder& builder() { return builder_; }

  Status describe() { return builder_.learn(description_); }

  // Adds the set `number`, exposed at `at_s`.
  Status add(std::uint64_t number, double at_s, std::optional<Timecode> timecode = std::nullopt) {
    Snapshot snapshot;
    snapshot.number = number;
    snapshot.timecode = timecode;
    snapshot.instants.exposed_at = from_ns(1'000'000'000) + from_s(at_s);
    SubjectLabels& labels = snapshot.labels.push_back({});
    labels.subject = SubjectId{0};
    for (std::size_t m = 0; m < 2; ++m) {
      LabelledMarker& marker = labels.markers.push_back({});
      marker.state = m == 0 ? LabelState::Measured : LabelState::Filled;
      marker.position.v = {static_cast<double>(number), static_cast<double>(m), 0.0};
      marker.residual_px = m == 0 ? 0.5 : 0.0;
      marker.cameras = 2;
    }
    SubjectPose& pose = snapshot.poses.push_back({});
    pose.subject = SubjectId{0};
    for (std::size_t b = 0; b < 2; ++b) {
      BonePose& bone = pose.bones.push_back({});
      bone.parent_from_bone.position = {static_cast<double>(number), 0.0, static_cast<double>(b)};
      bone.state = BoneState::Measured;
    }
    return builder_.add(snapshot, 5'000'000'000);
  }

 private:
  Description description_;
  ClipBuilder builder_;
};

std::vector<std::int64_t> numbers_of(const Clip& clip) {
  std::vector<std::int64_t> numbers;
  for (std::size_t f = 0; f < clip.frames; ++f) {
    const MarkerSample& marker = clip.subjects[0].markers[2 * f];
    numbers.push_back(marker.state == LabelState::Lost ? -1 : std::llround(marker.position_m.x()));
  }
  return numbers;
}

TEST(ClipBuilder, KeepsEverySampleOfTheRecording) {
  Recording take(120.0);
  ASSERT_TRUE(take.describe());
  for (std::uint64_t n = 0; n < 20; ++n) ASSERT_TRUE(take.add(n, static_cast<double>(n) / 120.0));

  const auto clip = take.builder().build();

  ASSERT_TRUE(clip) << clip.error().message;
  EXPECT_EQ(clip->frames, 20U);
  EXPECT_EQ(clip->rate.numerator, 120);
  EXPECT_EQ(clip->rate.denominator, 1);
  EXPECT_EQ(clip->first_utc_ns, 6'000'000'000);
  const MarkerSample& marker = clip->subjects[0].markers[2 * 7];
  EXPECT_EQ(marker.position_m, Eigen::Vector3d(7.0, 0.0, 0.0));
  EXPECT_EQ(marker.cameras, 2);
  EXPECT_EQ(clip->subjects[0].markers[2 * 7 + 1].state, LabelState::Filled);
  EXPECT_EQ(clip->subjects[0].bones[2 * 7 + 1].parent_from_bone.position, Eigen::Vector3d(7.0, 0.0, 1.0));
}

// One camera, 2 m away with a focal length of 1000 px: 2 mm a pixel.
TEST(ClipBuilder, MeasuresResidualsAsLengths) {
  Recording take(120.0);
  ASSERT_TRUE(take.describe());
  ASSERT_TRUE(take.add(0, 0.0));

  const auto clip = take.builder().build();

  EXPECT_NEAR(clip->subjects[0].markers[0].residual_m, 0.001, 1e-6);
}

TEST(ClipBuilder, MakesLostSetsMissingFrames) {
  Recording take(120.0);
  ASSERT_TRUE(take.describe());
  for (const std::uint64_t n : {0, 1, 2, 5, 6, 8, 9, 10, 11, 12})
    ASSERT_TRUE(take.add(n, static_cast<double>(n) / 120.0));

  const auto clip = take.builder().build();

  EXPECT_THAT(numbers_of(*clip), ::testing::ElementsAre(0, 1, 2, -1, -1, 5, 6, -1, 8, 9, 10, 11, 12));
  EXPECT_EQ(take.builder().report().missing, 3U);
}

// The clock of the cameras is 200 ppm slow and exposures jitter by 0.2 ms: after 70000 sets 14 periods.
TEST(ClipBuilder, LosesNoFrameToDriftAndJitter) {
  Recording take(30000.0 / 1001.0);
  ASSERT_TRUE(take.describe());
  constexpr std::uint64_t kSets = 70'000;
  for (std::uint64_t n = 0; n < kSets; ++n) {
    const double jitter_s = n % 3 == 0 ? 0.0 : n % 3 == 1 ? 2e-4 : -2e-4;
    ASSERT_TRUE(take.add(n, static_cast<double>(n) * 1.0002 * 1001.0 / 30000.0 + jitter_s));
  }

  const auto clip = take.builder().build();

  EXPECT_EQ(clip->frames, kSets);
  EXPECT_EQ(take.builder().report().missing, 0U);
  EXPECT_EQ(clip->rate.numerator, 30000);
  EXPECT_EQ(clip->rate.denominator, 1001);
}

TEST(ClipBuilder, DistinguishesRates) {
  for (const double hz : {23.976, 24.0, 29.97, 30.0, 59.94, 60.0, 100.0, 119.88, 120.0, 240.0}) {
    Recording take(0.0);
    ASSERT_TRUE(take.describe());
    for (std::uint64_t n = 0; n < 200; ++n) ASSERT_TRUE(take.add(n, static_cast<double>(n) / rate_of(hz).hz()));

    EXPECT_NEAR(take.builder().build()->rate.hz(), rate_of(hz).hz(), 1e-9) << hz;
  }
}

TEST(ClipBuilder, LeavesOutRepeatedInstants) {
  Recording take(100.0);
  ASSERT_TRUE(take.describe());
  for (const auto& [n, at_s] : {std::pair(0, 0.0), {1, 0.01}, {2, 0.0101}, {3, 0.02}, {4, 0.03}, {5, 0.04}}) {
    ASSERT_TRUE(take.add(static_cast<std::uint64_t>(n), at_s));
  }

  const auto clip = take.builder().build();

  EXPECT_THAT(numbers_of(*clip), ::testing::ElementsAre(0, 1, 3, 4, 5));
  EXPECT_EQ(take.builder().report().repeated, 1U);
}

TEST(ClipBuilder, KeepsASubjectThatComesLater) {
  Recording take(100.0);
  take.description().subjects.clear();
  ASSERT_TRUE(take.describe());
  ASSERT_TRUE(take.add(0, 0.0));
  ASSERT_TRUE(take.add(1, 0.01));
  take.description().subjects = {testing::sample_subject("anna", 0, 2, 0).subject};
  ASSERT_TRUE(take.describe());
  ASSERT_TRUE(take.add(2, 0.02));

  EXPECT_THAT(numbers_of(*take.builder().build()), ::testing::ElementsAre(-1, -1, 2));
}

TEST(ClipBuilder, RefusesAnotherMarkerSetUnderTheSameName) {
  Recording take(100.0);
  ASSERT_TRUE(take.describe());
  take.description().subjects = {testing::sample_subject("anna", 0, 3, 0).subject};

  EXPECT_THAT(take.describe().error().message, HasSubstr("changes from 2 markers"));
}

TEST(ClipBuilder, RefusesOtherNamesAndParentsInASetOfTheSameSize) {
  Recording markers(100.0), bones(100.0);
  for (Recording* take : {&markers, &bones}) ASSERT_TRUE(take->describe());
  markers.description().subjects[0].marker_set.markers[1].name = "LASI";
  bones.description().subjects[0].marker_set.skeleton.bones[1].parent = -1;

  EXPECT_THAT(markers.describe().error().message, HasSubstr("the name of marker 1 from 'M1' to 'LASI'"));
  EXPECT_THAT(bones.describe().error().message, HasSubstr("bone 1 from 'Chest' below bone 0 to 'Chest' below bone -1"));
}

// The clock of the cameras is 250 ppm slow: after 99 s, the time of a mark is 3 frames behind that of its frame.
TEST(ClipBuilder, PutsMarksOnTheNearestFrame) {
  Recording take(120.0);
  ASSERT_TRUE(take.describe());
  for (std::uint64_t n = 0; n < 12'000; ++n) ASSERT_TRUE(take.add(n, static_cast<double>(n) * 1.00025 / 120.0));
  const auto at = [](double frames) { return from_ns(1'000'000'000) + from_s(frames * 1.00025 / 120.0); };
  take.builder().mark(at(11'900.4), "late");
  take.builder().mark(at(7.6), "early");
  take.builder().mark(at(-3.0), "before");
  take.builder().mark(at(12'001.0), "after");

  const auto clip = take.builder().build();

  ASSERT_EQ(clip->rate.numerator, 120);
  ASSERT_EQ(clip->events.size(), 2U);
  EXPECT_EQ(clip->events[0].name, "early");
  EXPECT_DOUBLE_EQ(clip->events[0].time_s, 8.0 / 120.0);
  EXPECT_EQ(clip->events[1].name, "late");
  EXPECT_DOUBLE_EQ(clip->events[1].time_s, 11'900.0 / 120.0);
  EXPECT_EQ(take.builder().report().marks_outside, 2U);
}

TEST(ClipBuilder, PutsMarksIntoGaps) {
  Recording take(100.0);
  ASSERT_TRUE(take.describe());
  for (const std::uint64_t n : {0, 1, 2, 3, 40, 41}) ASSERT_TRUE(take.add(n, static_cast<double>(n) / 100.0));
  take.builder().mark(from_ns(1'000'000'000) + from_s(0.2), "gap");

  const auto clip = take.builder().build();

  ASSERT_EQ(clip->events.size(), 1U);
  EXPECT_DOUBLE_EQ(clip->events[0].time_s, 0.2);
}

TEST(ClipBuilder, ListsTheSubjectsIfOneOfTheWantedIsUnknown) {
  Recording take(100.0, {"anna", "ana"});
  ASSERT_TRUE(take.describe());
  ASSERT_TRUE(take.add(0, 0.0));

  EXPECT_EQ(take.builder().build().error().message, "the take has no subject 'ana'; its subjects are 'anna'");
}

TEST(ClipBuilder, RefusesAnUnknownSubject) {
  Recording take(100.0, {"nobody"});
  ASSERT_TRUE(take.describe());
  ASSERT_TRUE(take.add(0, 0.0));

  EXPECT_THAT(take.builder().build().error().message, HasSubstr("no subject 'nobody'"));
}

TEST(ClipBuilder, RefusesTimesThatCannotBe) {
  Recording take(100.0);
  ASSERT_TRUE(take.describe());
  for (const double at_s : {0.0, 0.01, 0.02, 0.03, 1e8}) ASSERT_TRUE(take.add(1, at_s));

  EXPECT_THAT(take.builder().build().error().message, HasSubstr("the times are wrong"));
}

TEST(ClipBuilder, CountsTimecodeBackToTheFirstFrame) {
  Recording take(120.0);
  ASSERT_TRUE(take.describe());
  ASSERT_TRUE(take.add(0, 0.0));
  for (std::uint64_t n = 1; n < 9; ++n)
    ASSERT_TRUE(take.add(n, static_cast<double>(n) / 120.0, Timecode{1, 0, 0, 2, 30, false, false, 1}));

  EXPECT_EQ(text_of(*take.builder().build()->first_timecode), "01:00:00:02");
}

TEST(ClipBuilder, CountsSubframesOn) {
  Recording take(120.0);
  ASSERT_TRUE(take.describe());
  for (std::uint64_t n = 0; n < 9; ++n) {
    ASSERT_TRUE(take.add(n, static_cast<double>(n) / 120.0, Timecode{1, 0, 0, 2, 30, false, false, 3}));
  }
  const Clip clip = *take.builder().build();

  EXPECT_EQ(text_of(timecode_at(clip, 0.0)), "01:00:00:02");
  EXPECT_EQ(text_of(timecode_at(clip, 1.0 / 120.0)), "01:00:00:03");
  EXPECT_EQ(timecode_at(clip, 6.0 / 120.0).subframe, 1U);
}

// At 29.97 Hz a free-running timecode of 30 frames per second gains a frame in 33 s.
TEST(ClipTimecode, RunsAtItsRecordedRate) {
  Clip clip = testing::sample_clip();
  clip.first_timecode = Timecode{1, 0, 0, 0, 30};

  EXPECT_EQ(text_of(timecode_at(clip, 60.0)), "01:01:00:00");
  clip.first_timecode->fractional = true;
  EXPECT_EQ(text_of(timecode_at(clip, 60.0)), "01:00:59:28");
}

TEST(Rates, AreFractions) {
  EXPECT_EQ(parse_rate("29.97")->numerator, 30000);
  EXPECT_EQ(parse_rate("23.976")->denominator, 1001);
  EXPECT_EQ(parse_rate("30000/1001")->denominator, 1001);
  EXPECT_EQ(parse_rate("12.5")->numerator, 25);
  for (const char* text : {"0", "-3", "abc", "1e9", "30/0", "24x", "nan"}) EXPECT_FALSE(parse_rate(text)) << text;
}

TEST(WithFill, LeavesOutFilledMarkers) {
  const Clip clip = with_fill(testing::sample_clip(), {.recorded = false});

  EXPECT_EQ(clip.subjects[0].markers[4 * 3].state, LabelState::Lost);
  EXPECT_EQ(clip.subjects[0].markers[4 * 4].state, LabelState::Measured);
}

TEST(WithFill, InterpolatesGapsUpToALength) {
  const double period_s = 1001.0 / 30000.0;

  const Clip filled = with_fill(testing::sample_clip(), {.longest_s = 5 * period_s});
  const Clip shorter = with_fill(testing::sample_clip(), {.longest_s = 4.9 * period_s});

  for (std::size_t f = 10; f <= 14; ++f) {
    const MarkerSample& marker = filled.subjects[0].markers[4 * f + 1];
    EXPECT_EQ(marker.state, LabelState::Filled);
    EXPECT_LT((marker.position_m - path_m(0, 1, static_cast<double>(f))).norm(), 1e-4);
    EXPECT_EQ(shorter.subjects[0].markers[4 * f + 1].state, LabelState::Lost);
  }
}

TEST(Cut, KeepsFramesTimesAndEvents) {
  Clip clip = testing::sample_clip();
  clip.first_frame = 0;

  const auto part = cut(clip, *parse_range_end("10f"), *parse_range_end("29f"));

  ASSERT_TRUE(part) << part.error().message;
  EXPECT_EQ(part->frames, 20U);
  EXPECT_EQ(part->first_frame, 10);
  EXPECT_EQ(part->subjects[1].markers.size(), 60U);
  EXPECT_EQ(part->subjects[0].markers[0].position_m, path_m(0, 0, 10.0));
  ASSERT_EQ(part->events.size(), 1U);
  EXPECT_NEAR(part->events[0].time_s, 0.5 - 10.0 * 1001.0 / 30000.0, 1e-12);
  EXPECT_EQ(text_of(*part->first_timecode), "01:03:00;10");
}

TEST(Cut, KeepsAnEventAtItsFirstFrameAndNoneBehindItsLast) {
  Clip clip = testing::sample_clip();
  clip.first_frame = 0;
  clip.events.clear();
  for (std::int64_t f = 0; f < 40; ++f) clip.events.push_back({clip.rate.time_s(f), std::to_string(f)});

  const auto part = cut(clip, *parse_range_end("11f"), *parse_range_end("31f"));

  ASSERT_EQ(part->events.size(), 21U);
  EXPECT_EQ(part->events.front().name, "11");
  EXPECT_EQ(part->events.back().name, "31");
}

TEST(Cut, UnderstandsSecondsAndTimecode) {
  Clip clip = testing::sample_clip();
  clip.first_frame = 0;

  const auto seconds = cut(clip, *parse_range_end("0.333667"), *parse_range_end("1s"));
  const auto timecode = cut(clip, *parse_range_end("01:03:00;10"), *parse_range_end("01:03:00;29"));

  EXPECT_EQ(seconds->first_frame, 10);
  EXPECT_EQ(seconds->frames, 20U);
  EXPECT_EQ(timecode->first_frame, 10);
  EXPECT_EQ(timecode->frames, 20U);
}

TEST(Cut, RefusesRangesWithoutFrames) {
  Clip clip = testing::sample_clip();
  EXPECT_THAT(cut(clip, *parse_range_end("10"), *parse_range_end("20")).error().message, HasSubstr("no frame"));
  EXPECT_FALSE(cut(clip, *parse_range_end("120f"), *parse_range_end("110f")));
  EXPECT_FALSE(cut(clip, *parse_range_end("01:03:00;99"), *parse_range_end("1")));
  clip.first_timecode.reset();
  EXPECT_THAT(cut(clip, *parse_range_end("01:03:00:00"), *parse_range_end("1")).error().message,
              HasSubstr("no timecode"));
  for (const char* text : {"", "f", "1.5f", "x", "nan", "1m"}) EXPECT_FALSE(parse_range_end(text)) << text;
}

TEST(Resampled, CopiesFramesOfTheSameTime) {
  const Clip clip = testing::sample_clip();

  const Clip half = resampled(clip, {15000, 1001}), twice = resampled(clip, {60000, 1001});

  EXPECT_EQ(half.frames, 20U);
  EXPECT_EQ(half.first_frame, 50);
  EXPECT_EQ(twice.frames, 79U);
  for (std::size_t f = 0; f < 20; ++f) {
    EXPECT_EQ(half.subjects[0].markers[4 * f].position_m, clip.subjects[0].markers[8 * f].position_m);
    EXPECT_EQ(twice.subjects[0].markers[16 * f].position_m, clip.subjects[0].markers[8 * f].position_m);
  }
}

TEST(Resampled, InterpolatesBetweenFramesButNotOverGaps) {
  const Clip clip = resampled(testing::sample_clip(), {120, 1});

  for (std::size_t f = 0; f < clip.frames; ++f) {
    const double recorded = static_cast<double>(f) / 120.0 * 30000.0 / 1001.0;
    const MarkerSample& marker = clip.subjects[0].markers[4 * f + 1];
    const bool in_gap = recorded > 9.0 && recorded < 15.0;
    ASSERT_EQ(marker.state == LabelState::Lost, in_gap) << recorded;
    if (!in_gap) {
      EXPECT_LT((marker.position_m - path_m(0, 1, recorded)).norm(), 1e-4);
    }
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.01 * recorded, Eigen::Vector3d::UnitZ()));
    EXPECT_LT(clip.subjects[0].bones[2 * f].parent_from_bone.rotation.angularDistance(turn), 1e-9);
  }
}

}  // namespace clip_test
}  // namespace mocap::exports
