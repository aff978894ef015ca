#include "calibration/diagnosis/diagnose_rig.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <numbers>
#include <utility>

#include "scene/ring_rig.h"
#include "support/bumped_camera.h"
#include "support/moving_markers.h"

namespace mocap::calibration {
namespace diagnose_rig_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kDegree = std::numbers::pi / 180.0;

// Cameras on a ring, at different heights and distances, so that no exchange is a symmetry of the rig.
Rig irregular_ring(int cameras, std::uint64_t seed) {
  scene::Random random(seed);
  Rig rig = scene::ring_rig(
      {.cameras = cameras, .radius_m = 4.0, .height_m = 2.5, .width_px = 1280, .height_px = 1024, .hfov_rad = 1.1});
  for (CameraModel& camera : rig) {
    const Eigen::Vector3d off(random.normal(), random.normal(), random.normal());
    camera.camera_from_world = scene::look_at(camera.centre().v + 0.2 * off, {0.0, 0.0, 1.0});
  }
  return rig;
}

RigFinding only_finding(const RigDiagnosis& diagnosis, const Rig& rig) {
  std::string all;
  for (const RigFinding& finding : diagnosis.findings) all += sentence_of(finding, rig) + "\n";
  EXPECT_THAT(diagnosis.findings, SizeIs(1)) << all;
  return diagnosis.findings.empty() ? RigFinding{} : diagnosis.findings.front();
}

/// The seeds and numbers of cameras of each test.
class DiagnoseRig : public ::testing::TestWithParam<int> {
 protected:
  static constexpr std::uint64_t kSeeds[] = {1, 2, 3};

  static std::size_t camera_of(std::uint64_t seed) { return (3 * seed) % static_cast<std::size_t>(GetParam()); }
  static Rig rig_of(std::uint64_t seed) { return irregular_ring(GetParam(), seed); }
};

TEST_P(DiagnoseRig, FindsNothingInACorrectRig) {
  for (const std::uint64_t seed : kSeeds) {
    const Rig rig = rig_of(seed);

    const RigDiagnosis diagnosis = diagnose_rig(rig, test::moving_markers(rig, seed));

    for (const RigFinding& finding : diagnosis.findings) ADD_FAILURE() << sentence_of(finding, rig);
    EXPECT_THAT(diagnosis.undetermined, IsEmpty());
  }
}

TEST_P(DiagnoseRig, FindsTwoExchangedCameras) {
  for (const std::uint64_t seed : kSeeds) {
    const Rig rig = rig_of(seed);
    const std::size_t a = camera_of(seed);
    const std::size_t b = (a + seed) % rig.size() == a ? (a + 1) % rig.size() : (a + seed) % rig.size();
    Take take = test::moving_markers(rig, seed);
    std::swap(take.cameras[a], take.cameras[b]);

    const RigFinding finding = only_finding(diagnose_rig(rig, take), rig);

    EXPECT_EQ(finding.fault, RigFault::Exchanged);
    EXPECT_EQ(finding.camera, std::min(a, b));
    EXPECT_EQ(finding.other, std::max(a, b));
  }
}

TEST_P(DiagnoseRig, FindsATurnedCameraAndItsRotation) {
  for (const std::uint64_t seed : kSeeds) {
    const Rig rig = rig_of(seed);
    const std::size_t c = camera_of(seed);
    Rig truth = rig;
    truth[c] = test::bumped(rig[c], 3.0 * kDegree, 0.02);

    const RigFinding finding = only_finding(diagnose_rig(rig, test::moving_markers(truth, seed)), rig);

    EXPECT_EQ(finding.fault, RigFault::OtherPose);
    EXPECT_EQ(finding.camera, c);
    EXPECT_NEAR(finding.turned_rad, 3.0 * kDegree, 0.05 * kDegree);
    EXPECT_NEAR(finding.moved_m, 0.02, 0.005);
  }
}

TEST_P(DiagnoseRig, FindsACameraUpsideDown) {
  for (const std::uint64_t seed : kSeeds) {
    const Rig rig = rig_of(seed);
    const std::size_t c = camera_of(seed);
    Take take = test::moving_markers(rig, seed);
    for (Picture& picture : take.cameras[c]) {
      for (Spot& spot : picture.spots) spot.at.v = Eigen::Vector2d(1279.0, 1023.0) - spot.at.v;
    }

    const RigFinding finding = only_finding(diagnose_rig(rig, take), rig);

    EXPECT_EQ(finding.fault, RigFault::UpsideDown);
    EXPECT_EQ(finding.camera, c);
  }
}

TEST_P(DiagnoseRig, FindsAMirroredImage) {
  for (const std::uint64_t seed : kSeeds) {
    const Rig rig = rig_of(seed);
    const std::size_t c = camera_of(seed);
    Take take = test::moving_markers(rig, seed);
    for (Picture& picture : take.cameras[c]) {
      for (Spot& spot : picture.spots) spot.at.v.x() = 1279.0 - spot.at.v.x();
    }

    const RigFinding finding = only_finding(diagnose_rig(rig, take), rig);

    EXPECT_EQ(finding.fault, RigFault::MirroredSides);
    EXPECT_EQ(finding.camera, c);
  }
}

TEST_P(DiagnoseRig, FindsAnotherLensAndItsFocalLength) {
  for (const std::uint64_t seed : kSeeds) {
    const Rig rig = rig_of(seed);
    const std::size_t c = camera_of(seed);
    const double ratio = seed % 2 == 0 ? 1.4 : 0.7;
    Rig truth = rig;
    truth[c].lens.fx_px *= ratio;
    truth[c].lens.fy_px *= ratio;

    const RigFinding finding = only_finding(diagnose_rig(rig, test::moving_markers(truth, seed)), rig);

    EXPECT_EQ(finding.fault, RigFault::OtherLens);
    EXPECT_EQ(finding.camera, c);
    EXPECT_NEAR(finding.focal_ratio, ratio, 0.01);
  }
}

TEST_P(DiagnoseRig, FindsACameraOneFrameLate) {
  for (const std::uint64_t seed : kSeeds) {
    const Rig rig = rig_of(seed);
    const std::size_t c = camera_of(seed);
    Take take = test::moving_markers(rig, seed);
    auto& pictures = take.cameras[c];
    for (std::size_t i = 0; i + 1 < pictures.size(); ++i) pictures[i].exposed_at = pictures[i + 1].exposed_at;
    pictures.pop_back();

    const RigFinding finding = only_finding(diagnose_rig(rig, take), rig);

    EXPECT_EQ(finding.fault, RigFault::OneFrameLate);
    EXPECT_EQ(finding.camera, c);
  }
}

TEST_P(DiagnoseRig, FindsTheRigOfAnotherRoom) {
  for (const std::uint64_t seed : kSeeds) {
    const Rig truth = rig_of(seed);
    Rig rig = rig_of(seed + 100);
    for (std::size_t c = 0; c < rig.size(); ++c)
      rig[c].camera_from_world =
          scene::look_at(truth[c].centre().v + Eigen::Vector3d(1.5, -0.7 * static_cast<double>(c % 3), 0.6),
                         {0.3 * static_cast<double>(c), 0.0, 1.0});

    const RigFinding finding = only_finding(diagnose_rig(rig, test::moving_markers(truth, seed)), rig);

    EXPECT_EQ(finding.fault, RigFault::OtherRig);
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, DiagnoseRig, ::testing::Values(4, 6, 8));

TEST(RigDiagnosis, OffersEveryExchangeOfASymmetricRig) {
  const Rig rig = scene::ring_rig(
      {.cameras = 4, .radius_m = 4.0, .height_m = 2.5, .width_px = 1280, .height_px = 1024, .hfov_rad = 1.1});
  Take take = test::moving_markers(rig, 5);
  std::swap(take.cameras[0], take.cameras[2]);

  const RigFinding finding = only_finding(diagnose_rig(rig, take), rig);

  EXPECT_EQ(finding.fault, RigFault::Exchanged);
  EXPECT_THAT(finding.alternatives, SizeIs(1));
  EXPECT_THAT(sentence_of(finding, rig), HasSubstr(rig[0].name + " and " + rig[2].name + " fit if exchanged"));
  EXPECT_THAT(sentence_of(finding, rig), HasSubstr(rig[1].name + " and " + rig[3].name));
}

TEST(RigDiagnosis, JudgesNothingWithoutMarkersOrWithTwoCameras) {
  const Rig six = irregular_ring(6, 1);
  Take empty = test::moving_markers(six, 1, 2.0);
  for (auto& camera : empty.cameras) {
    for (Picture& picture : camera) picture.spots.clear();
  }
  const Rig two = irregular_ring(2, 1);

  const RigDiagnosis of_six = diagnose_rig(six, empty);
  const RigDiagnosis of_two = diagnose_rig(two, test::moving_markers(two, 1, 2.0));

  EXPECT_THAT(of_six.findings, IsEmpty());
  EXPECT_THAT(of_six.undetermined, SizeIs(6));
  EXPECT_THAT(of_two.findings, IsEmpty());
  EXPECT_THAT(of_two.undetermined, SizeIs(2));
}

TEST(RigDiagnosis, FindsTwoFaultsAtOnce) {
  const Rig rig = irregular_ring(8, 4);
  Rig truth = rig;
  truth[6] = test::bumped(rig[6], 5.0 * kDegree, 0.0);
  Take take = test::moving_markers(truth, 4);
  std::swap(take.cameras[1], take.cameras[2]);

  const RigDiagnosis diagnosis = diagnose_rig(rig, take);

  ASSERT_THAT(diagnosis.findings, SizeIs(2));
  for (const RigFinding& finding : diagnosis.findings) {
    if (finding.fault == RigFault::Exchanged) {
      EXPECT_EQ(finding.camera, 1U);
      EXPECT_EQ(finding.other, 2U);
    } else {
      EXPECT_EQ(finding.fault, RigFault::OtherPose);
      EXPECT_EQ(finding.camera, 6U);
    }
  }
}

}  // namespace diagnose_rig_test
}  // namespace mocap::calibration
