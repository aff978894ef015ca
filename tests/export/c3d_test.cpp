#include "export/c3d.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <span>

#include "export/sample_clip.h"
#include "export/spec_c3d.h"
#include "scene/c3d.h"

namespace mocap::exports {
namespace c3d_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::SpecC3d;

std::string written(const Clip& clip, const WriteOptions& options = {}) {
  std::string bytes;
  const Status done = write_c3d(clip, options, [&](std::string_view piece) {
    bytes += piece;
    return Status{};
  });
  EXPECT_TRUE(done) << done.error().message;
  return bytes;
}

Result<scene::C3d> imported(const std::string& bytes) { return scene::parse_c3d(std::as_bytes(std::span(bytes))); }

// Single precision at 5 m: 0.0005 mm.
constexpr double kSame_mm = 0.001;

Clip long_clip(std::size_t frames) {
  Clip clip = testing::sample_clip(0);
  clip.rate = {120, 1};
  clip.frames = frames;
  clip.first_frame = 0;
  clip.subjects = {testing::sample_subject("anna", 0, 2, frames)};
  return clip;
}

TEST(WriteC3d, IsReadByAReaderOfTheSpecification) {
  const Clip clip = testing::sample_clip();

  const SpecC3d file(written(clip));

  EXPECT_THAT(file.labels(), ElementsAre("anna:M0", "anna:M1", "anna:M2", "anna:M3", "bob:M0", "bob:M1", "bob:M2",
                                         "prop:M0", "prop:M1"));
  EXPECT_EQ(file.labels("DESCRIPTIONS")[1], "Chest");
  EXPECT_EQ(file.frames(), 40U);
  EXPECT_EQ(file["POINT:UNITS"].text(), "mm");
  EXPECT_NEAR(file["POINT:RATE"].real(), 29.97003, 1e-5);
  for (std::size_t f = 0; f < 40; ++f) {
    for (std::size_t m = 0; m < 4; ++m) {
      const SpecC3d::Point& point = file.point(f, m);
      if (testing::lost(m, f)) {
        EXPECT_EQ(point.residual, -1);
        continue;
      }
      const Eigen::Vector3d truth_mm = 1e3 * testing::path_m(0, m, static_cast<double>(f));
      EXPECT_LT((Eigen::Vector3d(point.x, point.y, point.z) - truth_mm).norm(), kSame_mm);
      EXPECT_EQ(point.cameras, testing::filled(m, f) ? 0 : 0b111);
      const double residual_mm = -file["POINT:SCALE"].real() * static_cast<double>(point.residual);
      EXPECT_NEAR(residual_mm, testing::filled(m, f) ? 0.0 : 2.0, 0.1);
    }
  }
}

TEST(WriteC3d, IsReadByTheImporter) {
  const Clip clip = testing::sample_clip();

  for (const Unit unit : {Unit::Metre, Unit::Centimetre, Unit::Millimetre}) {
    const auto c3d = imported(written(clip, {.unit = unit}));

    ASSERT_TRUE(c3d) << c3d.error().message;
    EXPECT_EQ(c3d->labels.size(), 9U);
    EXPECT_EQ(c3d->frames, 40U);
    for (std::size_t f = 0; f < 40; ++f) {
      const scene::C3dSample& sample = c3d->sample(f, 5);  // bob:M1
      ASSERT_EQ(sample.there, !testing::lost(1, f));
      if (!sample.there) continue;
      EXPECT_LT((sample.position_m - testing::path_m(1, 1, static_cast<double>(f))).norm(), 1e-3 * kSame_mm);
      EXPECT_EQ(std::popcount(sample.cameras), 3);
    }
  }
}

TEST(WriteC3d, TurnsTheAxes) {
  const Clip clip = testing::sample_clip();

  const SpecC3d file(written(clip, {.axes = Axes::YUp}));

  const Eigen::Vector3d truth_mm = 1e3 * testing::path_m(0, 0, 5.0);
  EXPECT_NEAR(file.point(5, 0).x, truth_mm.y(), kSame_mm);
  EXPECT_NEAR(file.point(5, 0).y, truth_mm.z(), kSame_mm);
  EXPECT_NEAR(file.point(5, 0).z, truth_mm.x(), kSame_mm);
  EXPECT_EQ(file["POINT:Y_SCREEN"].text(), "+Y");
}

TEST(WriteC3d, HasTheGroupsThatReadersExpect) {
  const SpecC3d file(written(testing::sample_clip()));

  EXPECT_EQ(file["ANALOG:USED"].integer(), 0);
  EXPECT_EQ(file["ANALOG:RATE"].real(), file["POINT:RATE"].real());
  EXPECT_EQ(file["FORCE_PLATFORM:USED"].integer(), 0);
  EXPECT_EQ(file["SUBJECTS:USED"].integer(), 3);
  EXPECT_EQ(file["SUBJECTS:USES_PREFIXES"].integer(), 1);
  EXPECT_EQ(file["SUBJECTS:NAMES"].text(1), "bob");
  EXPECT_EQ(file["SUBJECTS:LABEL_PREFIXES"].text(2), "prop:");
  EXPECT_EQ(file["TRIAL:ACTUAL_START_FIELD"].integer(), 101);
  EXPECT_EQ(file["TRIAL:ACTUAL_END_FIELD"].integer(), 140);
  EXPECT_EQ(file.header_word(4), 101);
  EXPECT_EQ(file.header_word(5), 140);
  EXPECT_EQ(file["TIMECODE:START"].text(), "01:02:59;28");
}

TEST(WriteC3d, HasEventsInTheGroupAndInTheHeader) {
  Clip clip = testing::sample_clip();
  clip.events = {{0.5, "Clap"}, {61.25, "Jump of anna"}};

  const SpecC3d file(written(clip));

  ASSERT_EQ(file["EVENT:USED"].integer(), 2);
  EXPECT_EQ(file["EVENT:LABELS"].text(1), "Jump of anna");
  EXPECT_THAT(file["EVENT:TIMES"].dimensions, ElementsAre(2, 2));
  // The clip begins with frame 101 of the trial, so that frame 1 is 100 frames of 1001/30000 s earlier.
  EXPECT_EQ(file["EVENT:TIMES"].real(2), 1.0F);
  EXPECT_FLOAT_EQ(file["EVENT:TIMES"].real(3), 1.25F + 100.0F * 1001.0F / 30000.0F);
  EXPECT_EQ(file["EVENT:CONTEXTS"].text(0), "General");
  EXPECT_FALSE(file["EVENT:DESCRIPTIONS"].text(0).empty());
  EXPECT_EQ(file.header_word(150), 12345);
  EXPECT_EQ(file.header_word(151), 2);
  EXPECT_EQ(file.header_real(155), 61.25F);
  EXPECT_EQ(file.header_text(199, 8), "ClapJump");
}

TEST(WriteC3d, CutsNamesOfEventsBetweenCharacters) {
  Clip clip = testing::sample_clip();
  clip.events = {{0.5, "H\u00fc\u00e4\u00f6" + std::string(130, 'x')}, {0.6, std::string(126, 'x') + "\u00e4\u00f6"}};

  const SpecC3d file(written(clip));

  EXPECT_EQ(file["EVENT:LABELS"].text(0).size(), 127U);
  EXPECT_EQ(file["EVENT:LABELS"].text(1), std::string(126, 'x'));
  EXPECT_EQ(file.header_text(199, 8), "H\u00fc xxxx");
}

TEST(WriteC3d, CutsTheNameOfTheTakeBetweenCharacters) {
  Clip clip = testing::sample_clip();
  clip.name = std::string(126, 'x') + "\u00e4";

  const SpecC3d file(written(clip));

  EXPECT_EQ(file["MANUFACTURER:TAKE"].text(0), std::string(126, 'x'));
}

TEST(WriteC3d, HasTheRateOfTheRecordedTimecode) {
  Clip clip = testing::sample_clip();
  clip.first_timecode = Timecode{1, 0, 0, 0, 25};

  EXPECT_EQ(SpecC3d(written(clip))["TIMECODE:RATE"].real(), 25.0F);
  clip.first_timecode->fractional = true;
  EXPECT_FLOAT_EQ(SpecC3d(written(clip))["TIMECODE:RATE"].real(), 25.0F / 1.001F);
}

TEST(WriteC3d, HasNoPrefixForASingleSubject) {
  Clip clip = testing::sample_clip();
  clip.subjects.resize(1);

  const SpecC3d file(written(clip));

  EXPECT_EQ(file.labels()[0], "M0");
  EXPECT_EQ(file["SUBJECTS:USES_PREFIXES"].integer(), 0);
}

TEST(WriteC3d, Holds70000Frames) {
  const Clip clip = long_clip(70'000);

  const std::string bytes = written(clip);

  const SpecC3d file(bytes);
  EXPECT_EQ(file["POINT:FRAMES"].integer(), 65535);
  EXPECT_EQ(file["POINT:LONG_FRAMES"].real(), 70'000.0F);
  EXPECT_EQ(file.header_word(4), 1);
  EXPECT_EQ(file.header_word(5), 65535);
  EXPECT_EQ(file["TRIAL:ACTUAL_END_FIELD"].integer(0) + 65536 * file["TRIAL:ACTUAL_END_FIELD"].integer(1), 70'000);
  EXPECT_NEAR(file.point(69'999, 0).x, 1e3 * testing::path_m(0, 0, 69'999.0).x(), kSame_mm);
  const auto c3d = imported(bytes);
  ASSERT_TRUE(c3d) << c3d.error().message;
  EXPECT_EQ(c3d->frames, 70'000U);
}

TEST(WriteC3d, Holds300Markers) {
  Clip clip = testing::sample_clip(0);
  clip.frames = 5;
  for (std::size_t s = 0; s < 3; ++s) {
    clip.subjects[s] = testing::sample_subject("subject" + std::to_string(s), s, 100, 5);
  }

  const std::string bytes = written(clip);

  const SpecC3d file(bytes);
  ASSERT_EQ(file.labels().size(), 300U);
  EXPECT_EQ(file["POINT:LABELS"].dimensions[1], 255U);
  EXPECT_EQ(file["POINT:LABELS2"].dimensions[1], 45U);
  EXPECT_EQ(file["POINT:DESCRIPTIONS2"].dimensions[1], 45U);
  EXPECT_EQ(file.labels()[299], "subject2:M99");
  EXPECT_NEAR(file.point(4, 299).y, 1e3 * testing::path_m(2, 99, 4.0).y(), kSame_mm);
  const auto c3d = imported(bytes);
  ASSERT_TRUE(c3d) << c3d.error().message;
  EXPECT_EQ(c3d->labels[299], "subject2:M99");
}

TEST(WriteC3d, RefusesWhatTheFormatCannotHold) {
  const Sink nowhere = [](std::string_view) { return Status{}; };
  Clip clip = testing::sample_clip();
  clip.events.resize(256);
  EXPECT_THAT(write_c3d(clip, {}, nowhere).error().message, HasSubstr("256 events, at most 255"));

  clip.events.clear();
  clip.subjects[0].subject.marker_set.markers[0].name = std::string(200, 'x');
  EXPECT_THAT(write_c3d(clip, {}, nowhere).error().message, HasSubstr("expected at most 127; shorten it"));

  clip.subjects.clear();
  EXPECT_EQ(write_c3d(clip, {}, nowhere).error().code, ErrorCode::InvalidArgument);
}

TEST(WriteC3d, EndsWhenTheSinkFails) {
  const Sink full = [](std::string_view) { return Status(Error{ErrorCode::Io, "full"}); };

  EXPECT_EQ(write_c3d(testing::sample_clip(), {}, full).error().message, "full");
}

}  // namespace c3d_test
}  // namespace mocap::exports
