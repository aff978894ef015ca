#include "take/take_quality.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "example_take.h"

namespace mocap::take {
namespace take_quality_test {

constexpr int kSets = 240;  // 2 s

// A set in which every camera sees every marker of every subject.
v1::Snapshot perfect(std::uint64_t set) {
  const Description description = example_description();
  v1::Snapshot snapshot;
  snapshot.set_number(set);
  snapshot.mutable_instants()->set_exposed_at_ns(to_ns(example_time(set)));
  for (std::uint32_t i = 0; i < description.cameras.size(); ++i) snapshot.mutable_views()->add_cameras(i);
  for (std::uint32_t i = 0; i < description.subjects.size(); ++i) {
    v1::SubjectState& subject = *snapshot.add_subjects();
    subject.set_subject(i);
    subject.set_phase(v1::SUBJECT_PHASE_TRACKING);
    for (std::uint32_t m = 0; m < description.subjects[i].marker_set.markers.size(); ++m) {
      subject.mutable_markers()->add_states(v1::MARKER_STATE_MEASURED);
      subject.mutable_markers()->add_track_ids_plus_one(100 * i + m + 1);
      subject.mutable_markers()->add_residuals_millipx(200);
    }
  }
  return snapshot;
}

template <class Change>
QualityReport measure(Change change) {
  TakeMeter meter;
  meter.describe(example_description());
  for (int set = 0; set < kSets; ++set) {
    v1::Snapshot snapshot = perfect(static_cast<std::uint64_t>(set));
    if (change(set, snapshot)) meter.add(snapshot);
  }
  return meter.report();
}

bool has_reason(const QualityReport& report, const std::string& words) {
  return std::ranges::any_of(report.reasons, [&](const std::string& r) { return r.find(words) != std::string::npos; });
}

TEST(TakeQuality, OfATakeWithoutAFaultIsGood) {
  const QualityReport report = measure([](int, v1::Snapshot&) { return true; });

  EXPECT_EQ(report.quality, TakeQuality::Good) << to_json(report);
  EXPECT_TRUE(report.reasons.empty());
  EXPECT_EQ(report.sets, static_cast<std::uint64_t>(kSets));
  EXPECT_NEAR(report.seconds, (kSets - 1) / 120.0, 1e-6);
  EXPECT_NEAR(report.residual_px, 0.2, 1e-9);
}

TEST(TakeQuality, OfAnEmptyTakeIsBad) {
  const QualityReport report = measure([](int, v1::Snapshot&) { return false; });

  EXPECT_EQ(report.quality, TakeQuality::Bad);
}

TEST(TakeQuality, CountsLostSetsByTheirNumbers) {
  const QualityReport one = measure([](int set, v1::Snapshot&) { return set != 100; });
  const QualityReport many = measure([](int set, v1::Snapshot&) { return set < 100 || set >= 110; });

  EXPECT_EQ(one.lost_sets, 1U);
  EXPECT_EQ(one.quality, TakeQuality::Look);
  EXPECT_EQ(many.lost_sets, 10U);
  EXPECT_EQ(many.quality, TakeQuality::Bad);
  EXPECT_TRUE(has_reason(many, "10 of 240 sets lost"));
}

TEST(TakeQuality, TellsTheMarkerThatIsSeldomSeenAndItsLongestGap) {
  const QualityReport report = measure([](int set, v1::Snapshot& snapshot) {
    if (set >= 60 && set < 180) snapshot.mutable_subjects(0)->mutable_markers()->set_states(2, v1::MARKER_STATE_FILLED);
    return true;
  });

  const MarkerFigures& marker = report.subjects[0].markers[2];
  EXPECT_EQ(marker.seen, 120U);
  EXPECT_EQ(marker.filled, 120U);
  EXPECT_NEAR(marker.longest_gap_s, 121 / 120.0, 1e-6);
  EXPECT_EQ(report.quality, TakeQuality::Look);
  EXPECT_TRUE(has_reason(report, "seen seldom: " + marker.name + " 50 %")) << to_json(report);
  EXPECT_TRUE(has_reason(report, "long gaps: " + marker.name + " 1.01 s")) << to_json(report);
}

TEST(TakeQuality, AGapAtTheEndCounts) {
  const QualityReport report = measure([](int set, v1::Snapshot& snapshot) {
    if (set >= 120) snapshot.mutable_subjects(0)->mutable_markers()->set_states(0, v1::MARKER_STATE_LOST);
    return true;
  });

  EXPECT_NEAR(report.longest_gap_s, 1.0, 1e-6);
}

TEST(TakeQuality, CountsTracksThatChangeTheirLabel) {
  const QualityReport report = measure([](int set, v1::Snapshot& snapshot) {
    auto& tracks = *snapshot.mutable_subjects(0)->mutable_markers()->mutable_track_ids_plus_one();
    if (set >= 100) tracks.SwapElements(0, 1);
    return true;
  });

  EXPECT_EQ(report.subjects[0].label_changes, 2U);
  EXPECT_TRUE(has_reason(report, "2 label changes"));
}

TEST(TakeQuality, ASubjectThatWasNotFoundMakesATakeBad) {
  const QualityReport report = measure([](int, v1::Snapshot& snapshot) {
    snapshot.mutable_subjects(0)->set_phase(v1::SUBJECT_PHASE_SEARCHING);
    return true;
  });

  EXPECT_EQ(report.quality, TakeQuality::Bad);
  EXPECT_TRUE(has_reason(report, "tracked in 0.0 % of the sets"));
}

TEST(TakeQuality, TellsTheCameraThatDeliversLess) {
  const QualityReport report = measure([](int set, v1::Snapshot& snapshot) {
    if (set % 10 == 0) snapshot.mutable_views()->mutable_cameras()->RemoveLast();
    return true;
  });

  EXPECT_EQ(report.quality, TakeQuality::Look);
  EXPECT_TRUE(has_reason(report, "in 90.0 % of the sets"));
}

TEST(TakeQuality, IsAddedAsFarAsItFitsOnAFullDisk) {
  TakeInfo few, many;
  many.notes = std::string(kMaxInfo_bytes, 'n');

  add_quality(few, crowd_report(6), "");
  add_quality(many, crowd_report(kMaxSubjects), "the disk is full");

  EXPECT_TRUE(few.others.contains("quality_figures"));
  EXPECT_FALSE(many.others.contains("quality_figures"));
  EXPECT_EQ(many.others.at("quality"), "bad");
  EXPECT_EQ(many.others.at("ended_early"), "the disk is full");
  EXPECT_TRUE(fits_on_a_full_disk(many));
}

}  // namespace take_quality_test
}  // namespace mocap::take
