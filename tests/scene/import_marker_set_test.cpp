#include "scene/import_marker_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "support/places.h"
#include "support/test_body.h"

namespace mocap::scene {
namespace import_marker_set_test {

std::optional<C3d> shared_c3d(const std::string& name) {
  const std::filesystem::path path = std::filesystem::path(support::shared_data_folder()) / "c3d" / name;
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  const std::string bytes(std::istreambuf_iterator<char>(in), {});
  auto c3d = parse_c3d(std::as_bytes(std::span(bytes)));
  if (!c3d) return std::nullopt;
  return *std::move(c3d);
}

Skeleton human() { return test::person("pluginGait39").skeleton; }

TEST(KnownMarker, IsFoundInEachConvention) {
  EXPECT_EQ(known_marker("LASI")->bone, "Hips");
  EXPECT_EQ(known_marker("Anna:RASI")->bone, "Hips");
  EXPECT_LT(known_marker("Anna:RASI")->offset_m.y(), 0.0);
  EXPECT_EQ(known_marker("lknm")->bone, "LeftUpLeg");
  EXPECT_EQ(known_marker("RShoulderTop")->bone, "RightCollar");
  EXPECT_EQ(known_marker("Skeleton_LUArm2")->bone, "LeftUpArm");
  EXPECT_FALSE(known_marker("Trolley1"));
  EXPECT_FALSE(known_marker(""));
}

TEST(KnownMarker, HasTheOffsetOfTheShippedMarkerSets) {
  for (const char* name : {"pluginGait39", "baseline41"}) {
    const MarkerSet set = test::person(name);
    for (const MarkerOnBone& marker : set.markers) {
      if (marker.name == "BackTop") continue;  // on the neck in the shipped set, on the back in other sets
      const auto known = known_marker(marker.name);
      ASSERT_TRUE(known) << marker.name;
      EXPECT_EQ(known->bone, set.skeleton.bones[static_cast<std::size_t>(marker.bone)].name) << marker.name;
      // Some markers of the shipped sets are asymmetric on purpose, by up to 40 mm.
      EXPECT_LT((known->offset_m - marker.offset_m).norm(), 0.041) << marker.name;
    }
  }
}

TEST(ImportMarkerSet, OmitsPointsThatAreNoMarkersAndListsUnknownLabels) {
  C3d c3d;
  c3d.labels = {"Anna:LASI", "Anna:RASI", "Anna:LPSI", "Anna:C7", "Anna:Hat", "*110", "LKneeAngles", "Anna:C7", "CLAV"};
  c3d.frames = 1;
  c3d.samples.resize(c3d.labels.size());
  for (std::size_t i = 0; i + 1 < c3d.samples.size(); ++i) c3d.samples[i].there = true;

  const auto imported = import_marker_set(c3d, human(), "anna");

  ASSERT_TRUE(imported);
  ASSERT_EQ(imported->marker_set.markers.size(), 4U);
  EXPECT_EQ(imported->marker_set.markers[0].name, "LASI");
  EXPECT_EQ(imported->unknown, std::vector<std::string>{"Anna:Hat"});
  EXPECT_EQ(imported->twice, std::vector<std::string>{"Anna:C7"});
  EXPECT_EQ(imported->never_seen, 1U);
  EXPECT_EQ(imported->ghosts, 1U);
  EXPECT_EQ(imported->model_outputs, 1U);
}

TEST(ImportMarkerSet, RefusesAFileWithUnknownLabelsOnly) {
  C3d c3d;
  c3d.labels = {"a", "b", "c"};
  c3d.frames = 1;
  c3d.samples.resize(3);

  EXPECT_FALSE(import_marker_set(c3d, human(), "nobody"));
}

struct Trial {
  const char* still;
  const char* moving;
  std::size_t markers;
  double max_rms_from_still_m;
  double max_rms_from_motion_m;
};

class RecordedSubject : public ::testing::TestWithParam<Trial> {};

TEST_P(RecordedSubject, HasSmallResidualsInAMovementAfterAFit) {
  const auto still = shared_c3d(GetParam().still);
  const auto moving = shared_c3d(GetParam().moving);
  if (!still || !moving) GTEST_SKIP() << "no shared data at " << support::shared_data_folder();
  const auto imported = import_marker_set(*still, human(), "somebody");
  ASSERT_TRUE(imported);
  EXPECT_EQ(imported->marker_set.markers.size(), GetParam().markers);
  const bodyfit::LabelledTake at_rest = take_of(*still, imported->marker_set);
  const bodyfit::LabelledTake motion = take_of(*moving, imported->marker_set);

  const auto fitted = bodyfit::fit_subject(imported->marker_set, at_rest, {}, {});
  const auto better = bodyfit::fit_subject(imported->marker_set, at_rest, motion, {});

  ASSERT_TRUE(fitted && better);
  // A static trial does not determine the joint centres. Skin motion contributes some mm; the rest is joint centres.
  EXPECT_LT(bodyfit::residuals_of(fitted->marker_set, motion, 5).rms_m, GetParam().max_rms_from_still_m);
  EXPECT_LT(bodyfit::residuals_of(better->marker_set, motion, 5).rms_m, GetParam().max_rms_from_motion_m);
  EXPECT_TRUE(fitted->from_rest);
}

INSTANTIATE_TEST_SUITE_P(
    C3d, RecordedSubject,
    ::testing::Values(Trial{"btk_pig_walk_static_100.c3d", "btk_pig_walk_fullbody_100.c3d", 35, 0.010, 0.006},
                      Trial{"pycgm_static_38unlabelled_120.c3d", "pycgm_movement_42unlabelled_120.c3d", 39, 0.018,
                            0.006},
                      // No static trial: the median of a moving take contains hardly any information.
                      Trial{"btk_optitrack36_100.c3d", "btk_optitrack36_100.c3d", 36, 1.0, 0.013}));

}  // namespace import_marker_set_test
}  // namespace mocap::scene
