#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "metamorphic/recording.h"
#include "wire/codec/camera_blobs.h"

// Metamorphic relations: a change of the input whose effect on the output is known without a truth. Each relation is
// checked on three scenes.

namespace mocap::metamorphic {
namespace relations_test {

// The order of a sum changes the last digits of a position, and these change which of two equally good hypotheses is
// taken for a set: an rms over the scene below the noise of a marker, 0.1 mm.
constexpr double kSame_m = 1e-4;
constexpr double kSameBones_m = 2e-3;  // bones of few markers follow the markers' differences by their lever
constexpr double kOthers = 0.005;      // share of the labels that only one answer has

class Relation : public ::testing::TestWithParam<int> {
 protected:
  const Recording& original() const { return recording_of(GetParam()); }
  const Answer& answer() const { return answer_to_scene(GetParam()); }

  // `scale`: on all tolerances. `others`: largest share of the labels that only one answer has.
  void expect_same(const Recording& changed, const Mapping& mapping = {}, double scale = 1.0,
                   double others = kOthers) const {
    const Difference difference = difference_of(answer(), answer_to(changed), mapping);
    EXPECT_LT(difference.markers_rms_m, scale * kSame_m);
    EXPECT_LT(difference.bones_rms_m, scale * kSameBones_m);
    EXPECT_LT(difference.others, scale * others);
  }
  void expect_equal(const Recording& changed) const { EXPECT_EQ(answer_to(changed).bytes, answer().bytes); }
};

INSTANTIATE_TEST_SUITE_P(Scenes, Relation, ::testing::Range(0, kScenes));

TEST_P(Relation, TheScenesHaveLabelsAndSkeletons) {
  const scoring::EvalFrame& last = answer().frames.back();

  EXPECT_GT(last.markers.size(), 10u);
  EXPECT_GT(last.bones.size(), 10u);
}

void move_world(Recording& recording, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& shift_m) {
  for (CameraModel& camera : recording.settings.rig) {
    Eigen::Matrix3d turned = camera.camera_from_world.rotation * rotation.transpose();
    camera.camera_from_world.translation -= turned * shift_m;
    camera.camera_from_world.rotation = turned;
  }
}

TEST_P(Relation, RotatingAndShiftingTheWorldRotatesAndShiftsTheAnswer) {
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d shift_m(1.5, -0.5, 0.0);
  Recording changed = original();
  move_world(changed, rotation, shift_m);

  Mapping mapping;
  mapping.position = [&](const Eigen::Vector3d& at) -> Eigen::Vector3d { return rotation * at + shift_m; };
  expect_same(changed, mapping);
}

TEST_P(Relation, MirroringTheWorldMirrorsTheAnswer) {
  const Eigen::DiagonalMatrix<double, 3> left_right(1.0, -1.0, 1.0), image(-1.0, 1.0, 1.0);
  Recording changed = original();
  for (CameraModel& camera : changed.settings.rig) {
    camera.camera_from_world.rotation = image * camera.camera_from_world.rotation * left_right;
    camera.camera_from_world.translation = image * camera.camera_from_world.translation;
  }
  for (Subject& subject : changed.settings.subject_models) {
    for (Bone& bone : subject.marker_set.skeleton.bones) bone.rest_offset_m.y() *= -1.0;
    for (MarkerOnBone& marker : subject.marker_set.markers) marker.offset_m.y() *= -1.0;
  }
  for (BlobFrame& frame : changed.frames) {
    const double centre_px = changed.settings.rig[frame.camera.value].lens.cx_px;
    for (Blob& blob : frame.blobs) {
      blob.centroid.v.x() = 2.0 * centre_px - blob.centroid.v.x();
      blob.axis_rad = std::numbers::pi - blob.axis_rad;
    }
  }

  Mapping mapping;
  mapping.position = [&](const Eigen::Vector3d& at) -> Eigen::Vector3d { return left_right * at; };
  expect_same(changed, mapping);
}

// The gates are lengths, so that a scale changes which hypotheses are tried: ten times the tolerance.
TEST_P(Relation, ScalingTheWorldScalesTheAnswer) {
  constexpr double kScale = 1.05;
  Recording changed = original();
  for (CameraModel& camera : changed.settings.rig) camera.camera_from_world.translation *= kScale;
  for (Subject& subject : changed.settings.subject_models) {
    for (Bone& bone : subject.marker_set.skeleton.bones) bone.rest_offset_m *= kScale;
    for (MarkerOnBone& marker : subject.marker_set.markers) marker.offset_m *= kScale;
  }

  Mapping mapping;
  mapping.position = [=](const Eigen::Vector3d& at) -> Eigen::Vector3d { return kScale * at; };
  expect_same(changed, mapping, 10.0);
}

TEST_P(Relation, PermutingTheCamerasChangesNothing) {
  Recording changed = original();
  const auto cameras = static_cast<std::uint32_t>(changed.settings.rig.size());
  std::ranges::rotate(changed.settings.rig, changed.settings.rig.begin() + 1);
  for (BlobFrame& frame : changed.frames) frame.camera.value = (frame.camera.value + cameras - 1) % cameras;

  expect_same(changed);
}

TEST_P(Relation, PermutingTheBlobsOfAnImageChangesNothing) {
  Recording changed = original();
  for (BlobFrame& frame : changed.frames) std::reverse(frame.blobs.begin(), frame.blobs.end());

  expect_same(changed);
}

TEST_P(Relation, PermutingTheMarkersOfASetPermutesTheLabels) {
  Recording changed = original();
  std::vector<std::uint32_t> counts;
  for (Subject& subject : changed.settings.subject_models) {
    std::vector<MarkerOnBone>& markers = subject.marker_set.markers;
    counts.push_back(static_cast<std::uint32_t>(markers.size()));
    std::ranges::rotate(markers, markers.begin() + 5);
  }

  Mapping mapping;
  mapping.marker = [&](std::uint32_t subject, std::uint32_t marker) {
    return (marker + counts[subject] - 5) % counts[subject];
  };
  expect_same(changed, mapping);
}

// The subjects are searched in turn: which one is found first, and so the labels of the first 0.3 s, depend on the
// order.
TEST_P(Relation, PermutingTheSubjectsPermutesThem) {
  Recording changed = original();
  std::ranges::reverse(changed.settings.subject_models);

  Mapping mapping;
  const auto last = static_cast<std::uint32_t>(changed.settings.subject_models.size()) - 1;
  mapping.subject = [last](std::uint32_t subject) { return last - subject; };
  // Subjects are searched for in their order: they may be found a few sets earlier or later, with other first
  // positions.
  expect_same(changed, mapping, 2.0, 0.1);
}

TEST_P(Relation, ShiftingTheTimeChangesNothing) {
  Recording changed = original();
  for (BlobFrame& frame : changed.frames) {
    frame.exposed_at += std::chrono::hours(1000);
    frame.received_at += std::chrono::hours(1000);
    frame.detected_at += std::chrono::hours(1000);
  }

  expect_equal(changed);
}

TEST_P(Relation, RepeatingEachPacketChangesNothing) {
  Recording changed = original();
  changed.frames.clear();
  for (const BlobFrame& frame : original().frames) {
    changed.frames.push_back(frame);
    changed.frames.push_back(frame);
  }

  expect_equal(changed);
}

// Each camera delivers four images at once.
TEST_P(Relation, ChunksOfImagesChangeNothing) {
  constexpr std::uint64_t kChunk = 4;
  Recording changed = original();
  std::ranges::stable_sort(changed.frames, {},
                           [](const BlobFrame& frame) { return std::pair(frame.number / kChunk, frame.camera.value); });

  expect_equal(changed);
}

TEST_P(Relation, HandingTheBeliefToANewFusionChangesNothing) {
  EXPECT_EQ(answer_to(original(), 7).bytes, answer().bytes);
}

TEST_P(Relation, WritingTheBlobsToATakeAndReadingThemChangesNothing) {
  Recording changed = original();
  for (BlobFrame& frame : changed.frames) {
    v1::CameraBlobs message;
    wire::encode(frame, message);
    v1::CameraBlobs read;
    ASSERT_TRUE(read.ParseFromString(message.SerializeAsString()));
    const CameraId camera = frame.camera;
    const Result<BlobFrame> decoded = wire::decode(read);
    ASSERT_TRUE(decoded.has_value());
    frame = *decoded;
    frame.camera = camera;
  }

  expect_equal(changed);
}

// One more camera changes how many rays a new marker must have, and so the set in which some markers begin.
TEST_P(Relation, ACameraThatSeesNothingChangesLittle) {
  Recording changed = original();
  CameraModel away = changed.settings.rig.front();
  away.name = "away";
  // Turned by half a turn about its vertical axis: it looks out of the volume.
  const Eigen::Matrix3d half = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()).toRotationMatrix();
  away.camera_from_world.rotation = half * away.camera_from_world.rotation;
  away.camera_from_world.translation = half * away.camera_from_world.translation;
  const auto blind = static_cast<std::uint32_t>(changed.settings.rig.size());
  changed.settings.rig.push_back(away);
  changed.frames.clear();
  for (const BlobFrame& frame : original().frames) {
    changed.frames.push_back(frame);
    if (frame.camera.value + 1 != blind) continue;
    BlobFrame& empty = changed.frames.emplace_back();
    empty.camera = CameraId{blind};
    empty.number = frame.number;
    empty.exposed_at = empty.received_at = empty.detected_at = frame.exposed_at;
  }

  expect_same(changed, {}, 10.0);
}

}  // namespace relations_test
}  // namespace mocap::metamorphic
