#include "explain/search_explainer.h"

#include <gmock/gmock.h>

#include <numbers>

#include "explain/known_sets.h"
#include "scene/ring_rig.h"
#include "support/test_body.h"

namespace mocap::explain {
namespace search_explainer_test {

using test::person;
using testing::HasSubstr;

constexpr std::size_t kCameras = 6;

// A subject, the rig around it, and the report of a set in which all its markers are seen.
struct World {
  Rig rig = scene::ring_rig({.cameras = kCameras});
  std::vector<CameraSight> sights{kCameras, {60, {600, 0, 0, 0, 0, 0, 0}, {40.0, 2.0, 8.0, 0.0}}};
  MarkerSet own;
  std::vector<Subject> others;
  std::vector<MarkerSet> known{person("openmocap18"), person("baseline41"), person("pluginGait39")};
  SearchReport report;

  explicit World(const std::string& set) : own(person(set)) {
    report.subject = SubjectId{0};
    for (std::uint32_t i = 0; i < kCameras; ++i) report.views.push_back({CameraId{i}, 12, 10});
  }

  // Adds the markers of `worn` in rest pose with its root at `root`.
  void wear(const MarkerSet& worn, const Eigen::Vector3d& root = {0.1, 0.2, 0.96}) {
    kinematics::PoseFit body(worn, kinematics::PoseFit::Lengths::Fixed);
    std::vector<Pose> locals(body.locals().begin(), body.locals().end());
    locals[0].position = root;
    body.set_locals(locals);
    for (std::size_t m = 0; m < worn.markers.size(); ++m) report.points.push_back({body.marker_at(m)});
    report.confirmed = report.still = static_cast<std::uint32_t>(report.points.size());
  }
  // Removes the points below a height.
  void remove_below(double z_m) {
    BoundedVector<WorldPoint, kMaxReportPoints> high;
    for (const WorldPoint& point : report.points) {
      if (point.v.z() > z_m) high.push_back(point);
    }
    report.points = high;
    report.confirmed = report.still = static_cast<std::uint32_t>(high.size());
  }
  // Removes the points of the right leg, below 0.7 m. Returns their indices.
  std::vector<std::uint32_t> remove_right_leg() {
    std::vector<std::uint32_t> removed;
    BoundedVector<WorldPoint, kMaxReportPoints> left;
    for (std::uint32_t i = 0; i < report.points.size(); ++i) {
      if (report.points[i].v.y() < 0.2 && report.points[i].v.z() < 0.7) {
        removed.push_back(i);
      } else {
        left.push_back(report.points[i]);
      }
    }
    report.points = left;
    report.confirmed = report.still = static_cast<std::uint32_t>(left.size());
    return removed;
  }
  // Gives all cameras this focal length.
  void zoom(double focal_px) {
    for (CameraModel& camera : rig) camera.lens.fx_px = camera.lens.fy_px = focal_px;
  }
  // All markers become stationary candidates.
  void only_candidates() { report.confirmed = report.still = 0; }
  void blind(std::uint32_t camera, double brightest_grey) {
    report.views[camera].blobs = report.views[camera].in_markers = 0;
    sights[camera] = {60, {}, {40.0, 2.0, 8.0, brightest_grey}};
  }

  SearchHealth explain() {
    std::vector<Subject> subjects{{"anna", own, report.is_fitted}};
    subjects.insert(subjects.end(), others.begin(), others.end());
    return make_search_explainer({}, rig, subjects, known)->explain(report, sights);
  }
};

std::string sentence(const SearchHealth& health) { return std::string(text_of(health.sentence)); }

TEST(SearchExplainer, HasNoReasonForAStillPersonInTPose) {
  for (const char* set : {"openmocap18", "baseline41", "pluginGait39"}) {
    World world(set);
    world.wear(world.own);

    const SearchHealth health = world.explain();

    EXPECT_EQ(health.cause, SearchCause::None) << sentence(health);
    EXPECT_TRUE(health.sentence.empty());
  }
}

TEST(SearchExplainer, NamesTheBrightestPixelAndTheThresholdOfBlindCameras) {
  World world("openmocap18");
  for (std::uint32_t i = 0; i < kCameras; ++i) world.blind(i, 9.0);

  const SearchHealth health = world.explain();

  EXPECT_EQ(health.cause, SearchCause::NoBlobs);
  EXPECT_THAT(sentence(health), HasSubstr("anna is not found: no camera sees a marker"));
  EXPECT_THAT(sentence(health), HasSubstr("cam1 (brightest pixel 9 grey, threshold 40)"));
  EXPECT_THAT(sentence(health), HasSubstr("check lens caps"));
}

TEST(SearchExplainer, AdvisesMoreLightForMarkersThatAreTooDim) {
  World world("openmocap18");
  for (std::uint32_t i = 0; i < kCameras; ++i) world.blind(i, 35.0);

  EXPECT_THAT(sentence(world.explain()), HasSubstr("raise exposure or gain, or lower the threshold"));
}

TEST(SearchExplainer, NamesTheWornMarkerSet) {
  for (const auto& [own, worn] : {std::pair("openmocap18", "baseline41"), std::pair("baseline41", "openmocap18")}) {
    World world(own);
    world.wear(person(worn));

    const SearchHealth health = world.explain();

    EXPECT_EQ(health.cause, SearchCause::WrongMarkerSet) << sentence(health);
    EXPECT_EQ(text_of(health.known_set), worn);
    EXPECT_THAT(sentence(health), HasSubstr(std::string(worn) + " fits"));
  }
}

TEST(SearchExplainer, NamesCamerasWithoutMarkersIfTheOthersAreTooFew) {
  World world("baseline41");
  for (const std::uint32_t camera : {0U, 1U, 2U, 3U}) world.blind(camera, 9.0);

  const SearchHealth health = world.explain();

  EXPECT_EQ(health.cause, SearchCause::FewCameras);
  EXPECT_THAT(sentence(health), HasSubstr("only cam5 and cam6 see markers, and a new marker needs 3 cameras"));
}

TEST(SearchExplainer, NamesNoSetThatAnotherSubjectWears) {
  World world("openmocap18");
  world.others.push_back({"ben", person("baseline41"), false});
  world.wear(person("baseline41"));

  const SearchHealth health = world.explain();

  EXPECT_NE(health.cause, SearchCause::WrongMarkerSet) << sentence(health);
}

TEST(SearchExplainer, DoesNotCallACameraBlindForOneSetWithoutBlobs) {
  World world("openmocap18");
  world.report.views.clear();  // three images are late
  for (std::uint32_t i = 0; i < 3; ++i) world.report.views.push_back({CameraId{i}, 0, 0});

  const SearchHealth health = world.explain();

  EXPECT_NE(health.cause, SearchCause::NoBlobs) << sentence(health);
  EXPECT_NE(health.cause, SearchCause::FewCameras) << sentence(health);
}

TEST(SearchExplainer, BlamesCoveredCamerasThoughCandidatesResembleAFittedPerson) {
  World world("openmocap18");
  world.wear(world.own);
  world.only_candidates();
  world.report.is_fitted = true;
  for (const std::uint32_t camera : {0U, 1U, 2U, 3U}) world.blind(camera, 9.0);

  EXPECT_EQ(world.explain().cause, SearchCause::FewCameras);
}

TEST(SearchExplainer, SendsAPersonOfWhomCamerasSeeTheLegsAloneToTheMiddle) {
  World world("baseline41");
  world.wear(world.own);
  world.remove_below(0.9);
  world.zoom(20000.0);
  world.blind(0, 9.0);

  const SearchHealth health = world.explain();

  EXPECT_EQ(health.cause, SearchCause::OutOfView) << sentence(health);
  EXPECT_THAT(sentence(health), HasSubstr("move to the middle of the volume"));
}

TEST(SearchExplainer, ListsMissingMarkersThatCamerasHaveInView) {
  World world("baseline41");
  world.wear(world.own);
  world.remove_below(0.6);  // shins and feet

  const SearchHealth health = world.explain();

  EXPECT_EQ(health.cause, SearchCause::MarkersMissing) << sentence(health);
  ASSERT_GT(health.missing.size(), 0U);
  EXPECT_EQ(health.explained + health.missing.size(), 41U);
  for (const MissingMarker& missing : health.missing) EXPECT_EQ(missing.in_view_of, kCameras);
}

TEST(SearchExplainer, NamesTheMarkersOfAHiddenLeg) {
  for (const char* set : {"baseline41", "pluginGait39"}) {
    World world(set);
    world.wear(world.own);
    const std::vector<std::uint32_t> removed = world.remove_right_leg();

    const SearchHealth health = world.explain();

    std::vector<std::uint32_t> named;
    for (const MissingMarker& missing : health.missing) named.push_back(missing.marker);
    EXPECT_EQ(named, removed) << sentence(health);
  }
}

TEST(SearchExplainer, NamesNoMissingMarkersIfThePoseLeavesOthersUnexplained) {
  World world("baseline41");
  world.wear(world.own);
  world.remove_right_leg();
  world.wear(person("openmocap18"), {2.5, 0.2, 0.96});

  const SearchHealth health = world.explain();

  EXPECT_TRUE(health.missing.empty()) << sentence(health);
}

TEST(SearchExplainer, AsksAMovingPersonToStandStill) {
  World world("baseline41");
  world.wear(world.own);
  world.report.still = 3;

  const SearchHealth health = world.explain();

  EXPECT_EQ(health.cause, SearchCause::NotStill);
  EXPECT_THAT(sentence(health), HasSubstr("3 of 41 markers stand still: stand still in T-pose for 0.4 s"));
}

TEST(SearchExplainer, SaysThatNoTPoseFitsAPersonWithBentArms) {
  World world("baseline41");
  MarkerSet crouching = world.own;
  for (Bone& bone : crouching.skeleton.bones) {  // arms straight up, so that the hands are above the head
    if (std::abs(bone.rest_offset_m.y()) > 0.15) bone.rest_offset_m = {0.0, 0.0, std::abs(bone.rest_offset_m.y())};
  }
  world.wear(crouching);

  const SearchHealth health = world.explain();

  EXPECT_EQ(health.cause, SearchCause::NoPoseFits) << sentence(health);
  EXPECT_THAT(sentence(health), HasSubstr("stand upright in T-pose"));
}

TEST(SearchExplainer, SuspectsTheRigIfRaysDoNotMeet) {
  World world("baseline41");
  for (SearchView& view : world.report.views) view = {view.camera, 38, 1};

  const SearchHealth health = world.explain();

  EXPECT_EQ(health.cause, SearchCause::RigDoesNotFit);
  EXPECT_THAT(sentence(health), HasSubstr("see 38 blobs"));
  EXPECT_THAT(sentence(health), HasSubstr("mocap-calibrate verify"));
}

TEST(SearchExplainer, NamesTheMissingMarkerOfAProp) {
  World world("openmocap18");
  world.own = {"wand", {"wand", {}}, {}};
  world.own.skeleton.bones.emplace_back().name = "wand";
  const Eigen::Vector3d offsets[] = {{0.0, 0.0, 0.0}, {0.21, 0.0, 0.0}, {0.0, 0.13, 0.0}, {0.05, 0.02, 0.17}};
  for (int i = 0; i < 4; ++i) world.own.markers.push_back({"W" + std::to_string(i), 0, offsets[i]});
  for (int i = 0; i < 3; ++i) world.report.points.push_back({offsets[i] + Eigen::Vector3d(0.0, 0.0, 1.0)});
  world.report.confirmed = world.report.still = 3;

  const SearchHealth health = world.explain();

  EXPECT_EQ(health.cause, SearchCause::MarkersMissing) << sentence(health);
  ASSERT_EQ(health.missing.size(), 1U);
  EXPECT_EQ(health.missing[0].marker, 3U);
  EXPECT_LT((health.missing[0].position.v - Eigen::Vector3d(0.05, 0.02, 1.17)).norm(), 1e-3);
  EXPECT_THAT(sentence(health), HasSubstr("1 of 4 markers are missing (W3)"));
}

}  // namespace search_explainer_test
}  // namespace mocap::explain
