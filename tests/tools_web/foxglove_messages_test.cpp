#include "web/foxglove/foxglove_messages.h"

#include <gmock/gmock.h>

namespace mocap::web {
namespace foxglove_messages_test {

constexpr std::int64_t kUtcMinusHost_ns = 1'700'000'000'000'000'000;

v1::Description person() {
  v1::Description description;
  description.set_version(3);
  v1::Subject& subject = *description.add_subjects();
  subject.set_name("Anna");
  subject.add_bones()->set_name("Hips");
  v1::Bone& spine = *subject.add_bones();
  spine.set_name("Spine");
  spine.set_parent(0);
  for (const char* name : {"LASI", "RASI", "CLAV"}) subject.add_markers()->set_name(name);
  for (const float part : {1.0F, 0.5F, 0.0F}) subject.mutable_markers(0)->add_colour_rgb(part);
  return description;
}

v1::Snapshot standing() {
  v1::Snapshot snapshot;
  snapshot.set_description_version(3);
  snapshot.mutable_instants()->set_exposed_at_ns(5'250'000'000);
  snapshot.set_utc_minus_host_ns(kUtcMinusHost_ns);
  v1::SubjectState& state = *snapshot.add_subjects();
  v1::BonePoses& bones = *state.mutable_bones();
  for (const float z : {1.0F, 1.25F}) {
    bones.add_states(v1::BONE_STATE_MEASURED);
    for (const float part : {0.5F, -0.5F, z}) bones.add_world_positions_m(part);
    for (const float part : {0.0F, 0.0F, 0.6F, 0.8F}) bones.add_world_rotations_xyzw(part);
  }
  v1::LabelledMarkers& markers = *state.mutable_markers();
  for (const v1::MarkerState marker : {v1::MARKER_STATE_MEASURED, v1::MARKER_STATE_FILLED, v1::MARKER_STATE_LOST}) {
    markers.add_states(marker);
    for (const float part : {0.1F, 0.2F, 0.3F}) markers.add_positions_m(part);
  }
  for (const float part : {1.0F, 2.0F, 3.0F}) snapshot.mutable_unlabelled()->add_positions_m(part);
  return snapshot;
}

TEST(FoxgloveMessages, TransformsHaveThePosesOfBonesAtTheExposure) {
  const auto transforms = bones_of(standing(), person());

  ASSERT_EQ(transforms.transforms_size(), 2);
  const foxglove::FrameTransform& spine = transforms.transforms(1);
  EXPECT_EQ(spine.parent_frame_id(), "world");
  EXPECT_EQ(spine.child_frame_id(), "Anna/Spine");
  EXPECT_EQ(spine.timestamp().seconds(), 1'700'000'005);
  EXPECT_EQ(spine.timestamp().nanos(), 250'000'000);
  EXPECT_EQ(spine.translation().z(), 1.25);
  EXPECT_NEAR(spine.rotation().z(), 0.6, 1e-7);
  EXPECT_NEAR(spine.rotation().w(), 0.8, 1e-7);
}

TEST(FoxgloveMessages, ALostBoneHasNoTransform) {
  v1::Snapshot snapshot = standing();
  snapshot.mutable_subjects(0)->mutable_bones()->set_states(1, v1::BONE_STATE_LOST);

  EXPECT_EQ(bones_of(snapshot, person()).transforms_size(), 1);
}

TEST(FoxgloveMessages, TheSceneHasMarkersByStateBonesAndNames) {
  const auto scene = scene_of(standing(), person());

  ASSERT_EQ(scene.entities_size(), 2);
  const foxglove::SceneEntity& anna = scene.entities(0);
  EXPECT_EQ(anna.id(), "Anna");
  EXPECT_EQ(anna.frame_id(), "world");
  EXPECT_EQ(anna.lifetime().seconds(), 1);
  ASSERT_EQ(anna.spheres_size(), 2) << "a lost marker is not shown";
  EXPECT_EQ(anna.spheres(0).color().g(), 0.5);
  EXPECT_EQ(anna.spheres(0).color().a(), 1.0);
  EXPECT_LT(anna.spheres(1).color().a(), 1.0) << "a filled marker is translucent";
  ASSERT_EQ(anna.lines_size(), 1);
  ASSERT_EQ(anna.lines(0).points_size(), 2);
  EXPECT_EQ(anna.lines(0).points(0).z(), 1.0);
  EXPECT_EQ(anna.lines(0).points(1).z(), 1.25);
  EXPECT_EQ(anna.texts(0).text(), "Anna");
  ASSERT_EQ(scene.entities(1).spheres_size(), 1);
  EXPECT_EQ(scene.entities(1).spheres(0).pose().position().y(), 2.0);
}

TEST(FoxgloveMessages, ASnapshotOfAnotherDescriptionShowsNoSubject) {
  v1::Snapshot snapshot = standing();
  snapshot.set_description_version(4);

  EXPECT_EQ(bones_of(snapshot, person()).transforms_size(), 0);
  EXPECT_EQ(scene_of(snapshot, person()).entities_size(), 1) << "the markers without a label";
}

TEST(FoxgloveMessages, ColumnsThatAreTooShortAreLeftOut) {
  v1::Snapshot snapshot = standing();
  v1::SubjectState& state = *snapshot.mutable_subjects(0);
  state.mutable_bones()->mutable_world_positions_m()->Truncate(4);
  state.mutable_markers()->mutable_positions_m()->Truncate(2);
  snapshot.mutable_unlabelled()->mutable_positions_m()->Truncate(2);
  snapshot.add_subjects()->set_subject(9);

  EXPECT_EQ(bones_of(snapshot, person()).transforms_size(), 1);
  const auto scene = scene_of(snapshot, person());
  EXPECT_EQ(scene.entities(0).spheres_size(), 0);
  EXPECT_EQ(scene.entities(0).lines(0).points_size(), 0);
  EXPECT_EQ(scene.entities(1).spheres_size(), 0);
}

TEST(FoxgloveMessages, ABoneWhoseParentDoesNotExistHasNoLine) {
  v1::Description description = person();
  description.mutable_subjects(0)->mutable_bones(1)->set_parent(4'000'000'000);

  EXPECT_EQ(scene_of(standing(), description).entities(0).lines(0).points_size(), 0);
}

TEST(FoxgloveMessages, ACameraStandsAtItsCentreAndLooksAlongItsAxis) {
  v1::Description description;
  v1::Camera& camera = *description.add_cameras();
  camera.set_name("north");
  // Camera axes in the world: x = -y, y = -z, z = +x; centre (-4, 1, 2).
  v1::Quaternion& q = *camera.mutable_camera_from_world_rotation();
  q.set_x(0.5);
  q.set_y(-0.5);
  q.set_z(0.5);
  q.set_w(0.5);
  v1::Vector3& t = *camera.mutable_camera_from_world_translation_m();
  t.set_x(1.0);
  t.set_y(2.0);
  t.set_z(4.0);

  const auto transforms = cameras_of(description, 7'000'000'001);

  ASSERT_EQ(transforms.transforms_size(), 1);
  const foxglove::FrameTransform& pose = transforms.transforms(0);
  EXPECT_EQ(pose.child_frame_id(), "camera/north");
  EXPECT_EQ(pose.timestamp().nanos(), 1);
  EXPECT_NEAR(pose.translation().x(), -4.0, 1e-12);
  EXPECT_NEAR(pose.translation().y(), 1.0, 1e-12);
  EXPECT_NEAR(pose.translation().z(), 2.0, 1e-12);
}

TEST(FoxgloveMessages, AnImageIsTheJpegOfThePreview) {
  v1::Preview preview;
  preview.set_exposed_at_ns(2'000'000'000);
  preview.set_jpeg("jpeg bytes");

  const auto image = image_of(preview, "north", kUtcMinusHost_ns);

  EXPECT_EQ(image.frame_id(), "camera/north");
  EXPECT_EQ(image.format(), "jpeg");
  EXPECT_EQ(image.data(), "jpeg bytes");
  EXPECT_EQ(image.timestamp().seconds(), 1'700'000'002);
}

}  // namespace foxglove_messages_test
}  // namespace mocap::web
