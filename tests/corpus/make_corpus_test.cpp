#include "corpus/make_corpus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "corpus/figures.h"
#include "support/places.h"

namespace mocap::corpus {
namespace make_corpus_test {

const Plan& plan_named(const std::vector<Plan>& all, const std::string& name) {
  return *std::ranges::find(all, name, &Plan::name);
}

TEST(Corpus, HasFiftyRecordingsOfDifferentNames) {
  std::set<std::string> names;
  for (const Plan& plan : plans()) names.insert(plan.name);

  EXPECT_EQ(names.size(), plans().size());
  EXPECT_GE(names.size() + motion_plans().size(), 50U);
}

TEST(Corpus, HasEachKindOfFault) {
  std::set<chaos::FaultKind> kinds;
  for (const Plan& plan : plans()) {
    for (const chaos::Fault& fault : plan.episode.faults) kinds.insert(fault.kind);
  }

  EXPECT_EQ(kinds.size(), chaos::all_fault_kinds().size());
}

TEST(Corpus, IsSimulatedAlikeEachTime) {
  const auto all = plans();
  const auto first = simulate(plan_named(all, "frames-late-1").episode);
  const auto second = simulate(plan_named(all, "frames-late-1").episode);

  ASSERT_TRUE(first && second);
  ASSERT_EQ(first->inputs.size(), second->inputs.size());
  for (std::size_t i = 0; i < first->inputs.size(); ++i) {
    EXPECT_EQ(first->inputs[i].at, second->inputs[i].at);
    EXPECT_EQ(std::get<chaos::Arrival>(first->inputs[i].what).stamp,
              std::get<chaos::Arrival>(second->inputs[i].what).stamp);
  }
}

TEST(Corpus, HandsOverInTheOrderOfTime) {
  for (const char* name : {"host-stalls-1", "subject-removed-1", "frames-swapped-1"}) {
    const auto recording = simulate(plan_named(plans(), name).episode);

    ASSERT_TRUE(recording);
    EXPECT_TRUE(std::ranges::is_sorted(recording->inputs, {}, &Input::at)) << name;
  }
}

TEST(CorpusFigures, AreRightInACalmWorldAndSeeAWrongLabel) {
  const auto recording = simulate(plan_named(plans(), "calm-1").episode);
  ASSERT_TRUE(recording);
  const std::string world = support::source_folder() + "/tests/corpus/world";

  const auto figures = figures_of(*recording, world);
  Recording exchanged = *recording;
  for (Truth& truth : exchanged.truths) {
    for (TrueMarker& marker : truth.markers) marker.marker = static_cast<std::uint8_t>(marker.marker ^ 1U);
  }
  const auto wrong = figures_of(exchanged, world);

  ASSERT_TRUE(figures) << figures.error().message;
  EXPECT_EQ(figures->sets, 80U);  // every set of 2 s at 40 Hz
  EXPECT_GT(figures->judged, 200U);
  EXPECT_EQ(figures->wrong, 0U);
  EXPECT_LT(figures->rms, 3.0);
  EXPECT_EQ(figures->read, figures->sets);
  ASSERT_TRUE(wrong);
  EXPECT_EQ(wrong->hash, figures->hash);
  EXPECT_EQ(wrong->wrong, wrong->judged);
}

TEST(CorpusFigures, AreRefusedForACameraThatTheWorldLacks) {
  Recording recording;
  recording.bodies = {"openmocap18"};
  recording.rate_hz = 40.0;
  recording.patience = std::chrono::milliseconds(2);
  recording.inputs = {{from_ns(1), Order{OrderKind::Lose, 9}}};

  const auto figures = figures_of(recording, support::source_folder() + "/tests/corpus/world");

  ASSERT_FALSE(figures);
  EXPECT_EQ(figures.error().code, ErrorCode::InvalidArgument);
}

}  // namespace make_corpus_test
}  // namespace mocap::corpus
