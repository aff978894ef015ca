#include "lib/scoring/labels_score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

namespace mocap::scoring {
namespace labels_score_test {

constexpr std::uint32_t kMarkers = 4;

Timestamp at_set(int i) { return from_ns(1'000'000'000) + i * std::chrono::milliseconds(10); }

// Two subjects of four markers each, 300 mm apart, all seen by four cameras and tracked with complete skeletons.
EvalFrame truth_at(int set) {
  EvalFrame frame;
  frame.exposed_at = at_set(set);
  for (std::uint32_t s = 0; s < 2; ++s) {
    for (std::uint32_t m = 0; m < kMarkers; ++m) {
      frame.markers.push_back({s, m, LabelState::Measured, {0.01 * set, 0.3 * m, 1.0 * s}, 4});
    }
    frame.subjects.push_back({s, SubjectPhase::Tracking, true});
  }
  return frame;
}

NamedMarker& name(EvalFrame& frame, std::uint32_t subject, std::uint32_t marker) {
  return frame.markers[subject * kMarkers + marker];
}

// Scores the truth, modified by `change` in each set.
template <class Change>
std::map<std::uint32_t, LabelCounts> judge(int sets, Change change, LabelScorer& scorer) {
  for (int set = 0; set < sets; ++set) {
    EvalFrame truth = truth_at(set), said = truth;
    change(set, truth, said);
    scorer.add(truth, said);
  }
  return scorer.finish();
}

TEST(LabelScorer, ScoresTheTruthAsPerfect) {
  LabelScorer scorer;

  const auto counts = judge(
      100, [](int, EvalFrame&, EvalFrame&) {}, scorer);

  ASSERT_EQ(counts.size(), 2U);
  const LabelCounts& first = counts.at(0);
  EXPECT_EQ(*first.precision(), 1.0);
  EXPECT_EQ(*first.recall(), 1.0);
  EXPECT_EQ(*first.f1(), 1.0);
  EXPECT_EQ(*first.availability(), 1.0);
  EXPECT_EQ(first.wrong_events, 0U);
  EXPECT_EQ(first.visible, 400U);
  EXPECT_EQ(first.first_label_s, std::vector<double>{0.0});
  EXPECT_FALSE(first.reacquire_p95_s());
  EXPECT_EQ(*scorer.mot().mota(), 1.0);
  EXPECT_EQ(scorer.mot().switches, 0U);
}

TEST(LabelScorer, CountsASwapOfTwoLabelsForThreeSets) {
  LabelScorer scorer;
  const auto swap = [](int set, EvalFrame&, EvalFrame& said) {
    if (set >= 10 && set < 13) std::swap(name(said, 0, 1).position_m, name(said, 0, 2).position_m);
  };

  const LabelCounts counts = judge(100, swap, scorer).at(0);

  // 6 of 400 labels are wrong; 6 of 400 visible markers lack their label.
  EXPECT_NEAR(*counts.precision(), 394.0 / 400.0, 1e-12);
  EXPECT_NEAR(*counts.recall(), 394.0 / 400.0, 1e-12);
  EXPECT_NEAR(*counts.f1(), 394.0 / 400.0, 1e-12);
  EXPECT_EQ(counts.wrong_events, 2U);
  ASSERT_EQ(scorer.wrong_events().size(), 2U);
  const WrongEvent& event = scorer.wrong_events().front();
  EXPECT_EQ(event.subject, 0U);
  EXPECT_EQ(event.marker, 1U);
  EXPECT_EQ(event.sets, 3U);
  EXPECT_NEAR(event.from_s, 0.1, 1e-9);
  EXPECT_NEAR(event.farthest_m, 0.3, 1e-9);
  ASSERT_TRUE(event.on.has_value());
  EXPECT_EQ(event.on->marker, 2U);
  EXPECT_EQ(counts.longest_wrong_sets, 3U);
  EXPECT_EQ(counts.exchanged, 0U);
  EXPECT_EQ(scorer.mot().switches, 4U);  // two markers, each twice: swapped and swapped back
}

TEST(LabelScorer, CountsALabelThatMovesToAnotherSubject) {
  LabelScorer scorer;
  const auto move = [](int set, EvalFrame& truth, EvalFrame& said) {
    if (set < 50) return;
    name(said, 0, 1).position_m = name(truth, 1, 1).position_m;
  };

  const auto counts = judge(100, move, scorer);

  EXPECT_EQ(counts.at(0).exchanged, 50U);
  EXPECT_EQ(counts.at(0).wrong_events, 1U);
  EXPECT_EQ(counts.at(0).longest_wrong_sets, 50U);
  EXPECT_EQ(counts.at(1).exchanged, 0U);
}

TEST(LabelScorer, AcceptsLabelsWithinTwentyMillimetres) {
  LabelScorer scorer;
  const auto shift = [](int set, EvalFrame&, EvalFrame& said) {
    if (set == 20) name(said, 0, 0).position_m.z() += 0.0199;
    if (set == 30) name(said, 0, 0).position_m.z() += 0.0201;
  };

  const LabelCounts counts = judge(100, shift, scorer).at(0);

  EXPECT_EQ(counts.wrong, 1U);
  EXPECT_EQ(counts.right, 399U);
}

TEST(LabelScorer, DetectsASwapOfMarkersThatAreCloseTogether) {
  LabelScorer scorer;
  const auto swap = [](int set, EvalFrame& truth, EvalFrame& said) {
    name(truth, 0, 1).position_m = name(truth, 0, 0).position_m + Eigen::Vector3d(0.0, 0.0, 0.015);
    name(said, 0, 1).position_m = name(truth, 0, 1).position_m;
    if (set == 40) std::swap(name(said, 0, 0).position_m, name(said, 0, 1).position_m);
    if (set == 50) name(said, 0, 0).position_m.z() += 0.008;  // slightly closer to the other marker: noise
  };

  const LabelCounts counts = judge(100, swap, scorer).at(0);

  EXPECT_EQ(counts.wrong, 2U);
}

TEST(LabelScorer, ExpectsNoLabelForAMarkerThatOneCameraSees) {
  LabelScorer scorer;
  const auto hide = [](int, EvalFrame& truth, EvalFrame& said) {
    name(truth, 0, 3).cameras = 1;
    name(said, 0, 3).state = LabelState::Filled;
    name(said, 0, 3).position_m.z() += 0.03;
  };

  const LabelCounts counts = judge(100, hide, scorer).at(0);

  EXPECT_EQ(counts.visible, 300U);
  EXPECT_EQ(*counts.f1(), 1.0);
  EXPECT_EQ(counts.filled, 100U);
  EXPECT_EQ(counts.filled_off, 100U);
  EXPECT_NEAR(*counts.filled_rms_mm(), 30.0, 1e-6);
}

TEST(LabelScorer, CountsAVisibleMarkerThatIsOnlyFilledAsMissed) {
  LabelScorer scorer;
  const auto fill = [](int set, EvalFrame&, EvalFrame& said) {
    if (set >= 50) name(said, 0, 3).state = LabelState::Filled;
  };

  const LabelCounts counts = judge(100, fill, scorer).at(0);

  EXPECT_NEAR(*counts.recall(), 350.0 / 400.0, 1e-12);
  EXPECT_EQ(*counts.precision(), 1.0);
}

TEST(LabelScorer, StartsWithTheFirstLabel) {
  LabelScorer scorer;
  const auto late = [](int set, EvalFrame&, EvalFrame& said) {
    if (set >= 40) return;
    said.markers.clear();
    for (SubjectSaid& subject : said.subjects) subject = {subject.subject, SubjectPhase::Searching, false};
  };

  const LabelCounts counts = judge(100, late, scorer).at(0);

  EXPECT_EQ(counts.sets, 60U);
  EXPECT_EQ(*counts.f1(), 1.0);
  EXPECT_EQ(*counts.availability(), 1.0);
  EXPECT_NEAR(counts.first_label_s.at(0), 0.4, 1e-9);
}

TEST(LabelScorer, GivesZeroWithoutAnyLabel) {
  LabelScorer scorer;

  const LabelCounts counts = judge(
                                 100, [](int, EvalFrame&, EvalFrame& said) { said.markers.clear(); }, scorer)
                                 .at(0);

  EXPECT_FALSE(counts.precision());
  EXPECT_EQ(*counts.recall(), 0.0);
  EXPECT_EQ(*counts.f1(), 0.0);
  EXPECT_TRUE(counts.first_label_s.empty());
}

// No marker is visible in sets 20 to 39. The labels return in set `named`.
auto blackout(int named) {
  return [named](int set, EvalFrame& truth, EvalFrame& said) {
    if (set >= 20 && set < 40) {
      for (NamedMarker& marker : truth.markers) marker.cameras = 0, marker.state = LabelState::Filled;
    }
    if (set >= 20 && set < named) said.markers.clear();
  };
}

TEST(LabelScorer, MeasuresTheTimeUntilLabelsReturn) {
  LabelScorer soon, never;

  const LabelCounts back = judge(100, blackout(47), soon).at(0);
  const LabelCounts gone = judge(100, blackout(100), never).at(0);

  ASSERT_EQ(back.reacquire_s.size(), 1U);
  EXPECT_NEAR(back.reacquire_s[0], 0.07, 1e-9);
  EXPECT_EQ(*back.reacquired_share(0.5), 1.0);
  EXPECT_EQ(*back.reacquired_share(0.05), 0.0);
  EXPECT_EQ(back.visible, 80U * kMarkers);  // no label is expected during the outage
  ASSERT_EQ(gone.reacquire_s.size(), 1U);
  EXPECT_TRUE(std::isinf(gone.reacquire_s[0]));
  EXPECT_EQ(*gone.reacquired_share(0.5), 0.0);
}

TEST(LabelScorer, IgnoresMarkersThatTheTruthLacks) {
  LabelScorer scorer;
  const auto gap = [](int set, EvalFrame& truth, EvalFrame&) {
    if (set >= 50) truth.markers.erase(truth.markers.begin());
  };

  const LabelCounts counts = judge(100, gap, scorer).at(0);

  EXPECT_EQ(counts.unjudged, 50U);
  EXPECT_EQ(counts.wrong, 0U);
  EXPECT_EQ(*counts.f1(), 1.0);
}

TEST(LabelScorer, RecordsTheTimelineOfEveryMarker) {
  LabelScorer scorer(true);
  const auto mix = [](int set, EvalFrame&, EvalFrame& said) {
    if (set == 3) name(said, 0, 0).position_m.z() += 0.1;
    if (set == 4) name(said, 0, 0).state = LabelState::Filled;
    if (set == 5) said.markers.erase(said.markers.begin());
  };

  judge(8, mix, scorer);

  const Timeline& timeline = scorer.timelines().at(0);
  using enum LabelVerdict;
  EXPECT_EQ(timeline.markers.at(0), (std::vector{Right, Right, Right, Wrong, Filled, Lost, Right, Right}));
  EXPECT_EQ(timeline.t_s.size(), 8U);
}

TEST(LabelScorer, CountsGhostsButNotRecordedUnlabelledPoints) {
  LabelScorer scorer;
  const auto lights = [](int, EvalFrame& truth, EvalFrame& said) {
    truth.unlabelled_m = {{5.0, 5.0, 1.0}};
    said.unlabelled_m = {{5.0, 5.0, 1.04}, {5.0, 5.0, 1.06}, name(truth, 0, 0).position_m};
  };

  judge(10, lights, scorer);

  EXPECT_EQ(scorer.unlabelled(), 30U);
  EXPECT_EQ(scorer.ghosts(), 10U);
}

}  // namespace labels_score_test
}  // namespace mocap::scoring
