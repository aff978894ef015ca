#include "settings/subject/subject_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "settings/subject/marker_set_file.h"
#include "settings/subject/subject_keeper.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::settings {
namespace subject_file_test {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

const fs::path kMarkerSet = fs::path(support::source_folder()) / "config" / "markersets" / "baseline41.toml";

SubjectFile fitted_subject() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> flat(-0.5, 0.5);
  SubjectFile subject;
  subject.name = "Anna \"the\" first";
  subject.marker_set_file = kMarkerSet;
  subject.fitted_on = "2009-07-01T12:00:00Z";
  subject.size = 1.0 / 3.0;
  subject.residual_m = 0.0012345678901234567;
  subject.marker_set = *load_marker_set(kMarkerSet);
  for (Bone& bone : subject.marker_set.skeleton.bones) {
    if (bone.parent >= 0) bone.rest_offset_m = {flat(random), flat(random), flat(random)};
    subject.bone_residuals_m.push_back(bone.parent < 0 ? 0.0 : 0.01 + 0.01 * flat(random));
  }
  for (MarkerOnBone& marker : subject.marker_set.markers) {
    marker.offset_m = {flat(random), flat(random), flat(random)};
    subject.marker_residuals_m.push_back(0.01 + 0.01 * flat(random));
  }
  return subject;
}

class SubjectFileTest : public ::testing::Test {
 protected:
  std::string text() const {
    std::ifstream in(path_);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string faults_with(const std::string& from, const std::string& to) const {
    std::string all = text();
    const auto at = all.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    all.replace(at, from.size(), to);
    std::ofstream(path_) << all;
    const auto subject = load_subject(path_);
    return subject ? "" : to_text(subject.error());
  }

  support::TemporaryFolder folder_;
  fs::path path_ = folder_.path() / "anna.toml";
};

TEST_F(SubjectFileTest, ReadsBackTheSameBits) {
  const SubjectFile written = fitted_subject();
  ASSERT_TRUE(save_subject(path_, written));

  const auto read = load_subject(path_);

  ASSERT_TRUE(read) << to_text(read.error());
  EXPECT_EQ(read->name, written.name);
  EXPECT_EQ(read->fitted_on, written.fitted_on);
  EXPECT_EQ(read->size, written.size);
  EXPECT_EQ(read->residual_m, written.residual_m);
  EXPECT_TRUE(fs::equivalent(read->marker_set_file, kMarkerSet));
  for (std::size_t b = 0; b < written.marker_set.skeleton.bones.size(); ++b) {
    EXPECT_EQ(read->marker_set.skeleton.bones[b].rest_offset_m, written.marker_set.skeleton.bones[b].rest_offset_m);
  }
  for (std::size_t m = 0; m < written.marker_set.markers.size(); ++m) {
    EXPECT_EQ(read->marker_set.markers[m].offset_m, written.marker_set.markers[m].offset_m);
  }
  EXPECT_EQ(read->bone_residuals_m, written.bone_residuals_m);
  EXPECT_EQ(read->marker_residuals_m, written.marker_residuals_m);
}

TEST_F(SubjectFileTest, ListsFaultsWithTheirPlaces) {
  ASSERT_TRUE(save_subject(path_, fitted_subject()));
  const std::string whole = text();
  const auto faults = [&](const std::string& from, const std::string& to) {
    std::ofstream(path_) << whole;
    return faults_with(from, to);
  };

  EXPECT_THAT(faults("format = 1", "format = 2"), HasSubstr("anna.toml:3:10: format is 2, expected 1 to 1"));
  EXPECT_THAT(faults("\"LeftHand\"", "\"LeftHnad\""), HasSubstr("did you mean 'LeftHand'?"));
  EXPECT_THAT(faults("\"LeftHand\"", "\"LeftHnad\""), HasSubstr("bone 'LeftHand' is missing"));
  EXPECT_THAT(faults("\"HeadTop\"", "\"HeadFront\""), HasSubstr("is there twice"));
  EXPECT_THAT(faults("fitted_on", "fited_on"), HasSubstr("unknown key 'fited_on'"));
  EXPECT_THAT(faults("baseline41.toml", "baseline42.toml"), HasSubstr("anna.toml:5:14: marker_set cannot be used: "));
  EXPECT_THAT(faults("name = \"Anna", "nam = \"Anna"), HasSubstr("unknown key 'nam', did you mean 'name'?"));
  EXPECT_THAT(faults("offset_m = [", "offset_m = [9000.0, "), HasSubstr("expected"));
}

TEST_F(SubjectFileTest, IsReplacedAtEachFit) {
  const SubjectFile known = fitted_subject();
  const auto keeper = make_subject_keeper({{SubjectId{1}, path_, known}});
  SubjectFit fit;
  fit.subject = SubjectId{1};
  for (std::size_t b = 0; b < known.marker_set.skeleton.bones.size(); ++b)
    fit.rest_offsets_m.push_back({0.1, 0.2, 0.3});
  for (std::size_t m = 0; m < known.marker_set.markers.size(); ++m) fit.marker_offsets_m.push_back({0.0, 0.0, 0.1});
  SubjectFit of_another = fit;
  of_another.subject = SubjectId{0};

  ASSERT_TRUE(keeper->learn(of_another));
  EXPECT_FALSE(fs::exists(path_));
  ASSERT_TRUE(keeper->learn(fit));

  const auto read = load_subject(path_);
  ASSERT_TRUE(read) << to_text(read.error());
  EXPECT_EQ(read->marker_set.markers[3].offset_m, Eigen::Vector3d(0.0, 0.0, 0.1));
  EXPECT_EQ(read->marker_set.skeleton.bones[3].rest_offset_m, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_NE(read->fitted_on, known.fitted_on);
  EXPECT_FALSE(keeper->wants_snapshots());
}

TEST_F(SubjectFileTest, MarkerSetIsReadAsItWasWritten) {
  const MarkerSet set = *load_marker_set(kMarkerSet);
  const fs::path skeleton = fs::path(support::source_folder()) / "config" / "skeletons" / "human18.toml";
  ASSERT_TRUE(save_marker_set(path_, set, skeleton));

  const auto read = load_marker_set(path_);

  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->markers.size(), set.markers.size());
  for (std::size_t m = 0; m < set.markers.size(); ++m) {
    EXPECT_EQ(read->markers[m].name, set.markers[m].name);
    EXPECT_EQ(read->markers[m].bone, set.markers[m].bone);
    EXPECT_EQ(read->markers[m].offset_m, set.markers[m].offset_m);
  }
  EXPECT_EQ(read->asymmetric, set.asymmetric);
  EXPECT_FALSE(set.asymmetric.empty());
}

TEST_F(SubjectFileTest, SkeletonIsReadAsItWasWritten) {
  const Skeleton skeleton = load_marker_set(kMarkerSet)->skeleton;
  ASSERT_TRUE(save_skeleton(path_, skeleton));

  const auto read = load_skeleton(path_);

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->name, skeleton.name);
  ASSERT_EQ(read->bones.size(), skeleton.bones.size());
  for (std::size_t b = 0; b < skeleton.bones.size(); ++b) {
    EXPECT_EQ(read->bones[b].name, skeleton.bones[b].name);
    EXPECT_EQ(read->bones[b].parent, skeleton.bones[b].parent);
    EXPECT_EQ(read->bones[b].rest_offset_m, skeleton.bones[b].rest_offset_m);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ASSERT_EQ(read->bones[b].rotation_limits[axis].has_value(), skeleton.bones[b].rotation_limits[axis].has_value());
      if (!skeleton.bones[b].rotation_limits[axis]) continue;
      EXPECT_NEAR(read->bones[b].rotation_limits[axis]->min_rad, skeleton.bones[b].rotation_limits[axis]->min_rad,
                  1e-3);
      EXPECT_NEAR(read->bones[b].rotation_limits[axis]->max_rad, skeleton.bones[b].rotation_limits[axis]->max_rad,
                  1e-3);
    }
  }
}

}  // namespace subject_file_test
}  // namespace mocap::settings
