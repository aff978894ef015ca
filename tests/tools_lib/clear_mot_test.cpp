#include "lib/scoring/clear_mot.h"
#include "support/places.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

namespace mocap::scoring {
namespace clear_mot_test {

std::vector<std::uint64_t> ids(const nlohmann::json& list) { return list.get<std::vector<std::uint64_t>>(); }

TEST(ClearMot, AgreesWithTheWorkedExample) {
  const std::filesystem::path file = support::shared_data_folder() + "/metrics/clearmot_toy.json";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  std::ifstream stream(file);
  const auto toy = nlohmann::json::parse(stream);

  ClearMot mot;
  for (const auto& frame : toy.at("frames")) {
    std::vector<MotPair> pairs;
    for (std::uint32_t o = 0; o < frame.at("dist").size(); ++o) {
      for (std::uint32_t t = 0; t < frame.at("dist")[o].size(); ++t) {
        const auto& distance = frame.at("dist")[o][t];
        if (!distance.is_null()) pairs.push_back({o, t, distance.get<double>()});
      }
    }
    mot.add(ids(frame.at("objects")), ids(frame.at("tracks")), pairs);
  }

  const auto& expected = toy.at("expected");
  const ClearMot::Counts& counts = mot.counts();
  EXPECT_EQ(counts.matches, expected.at("num_matches"));
  EXPECT_EQ(counts.switches, expected.at("num_switches"));
  EXPECT_EQ(counts.false_positives, expected.at("num_false_positives"));
  EXPECT_EQ(counts.misses, expected.at("num_misses"));
  EXPECT_EQ(counts.detections(), expected.at("num_detections"));
  EXPECT_EQ(counts.objects, expected.at("num_objects"));
  EXPECT_EQ(counts.predictions, expected.at("num_predictions"));
  EXPECT_NEAR(*counts.mota(), expected.at("mota").get<double>(), 1e-12);
  EXPECT_NEAR(*counts.motp(), toy.at("derived_here").at("motp").get<double>(), 1e-12);
}

TEST(ClearMot, KeepsAPairAlthoughAnotherIsCloser) {
  ClearMot mot;
  const std::vector<std::uint64_t> objects{7}, tracks{1, 2};

  mot.add(objects, std::vector<std::uint64_t>{1}, std::vector<MotPair>{{0, 0, 1.0}});
  mot.add(objects, tracks, std::vector<MotPair>{{0, 0, 5.0}, {0, 1, 0.1}});

  EXPECT_EQ(mot.counts().matches, 2U);
  EXPECT_EQ(mot.counts().switches, 0U);
  EXPECT_EQ(mot.counts().false_positives, 1U);
  EXPECT_NEAR(mot.counts().distance, 6.0, 1e-12);
}

TEST(ClearMot, CountsASwitchAfterAGap) {
  ClearMot mot;
  const std::vector<std::uint64_t> objects{7};

  mot.add(objects, std::vector<std::uint64_t>{1}, std::vector<MotPair>{{0, 0, 1.0}});
  mot.add(objects, {}, {});
  mot.add(objects, std::vector<std::uint64_t>{2}, std::vector<MotPair>{{0, 0, 1.0}});

  EXPECT_EQ(mot.counts().misses, 1U);
  EXPECT_EQ(mot.counts().switches, 1U);
  EXPECT_NEAR(*mot.counts().mota(), 1.0 - 2.0 / 3.0, 1e-12);
}

TEST(ClearMot, HasNoFiguresWithoutObjects) {
  ClearMot mot;

  mot.add({}, std::vector<std::uint64_t>{1}, {});

  EXPECT_FALSE(mot.counts().mota());
  EXPECT_FALSE(mot.counts().motp());
  EXPECT_EQ(mot.counts().false_positives, 1U);
}

}  // namespace clear_mot_test
}  // namespace mocap::scoring
