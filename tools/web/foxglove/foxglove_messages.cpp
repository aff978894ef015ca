#include "web/foxglove/foxglove_messages.h"

#include <Eigen/Geometry>
#include <optional>

namespace mocap::web {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr double kMarkerDiameter_m = 0.02;
constexpr double kBoneThickness_m = 0.012;
constexpr double kNameHeight_m = 0.08;
constexpr double kNameAbove_m = 0.35;
constexpr double kFilledAlpha = 0.35;
constexpr double kUnlabelledGrey = 0.6;

using Numbers = google::protobuf::RepeatedField<float>;

google::protobuf::Timestamp timestamp_of(std::int64_t utc_ns) {
  google::protobuf::Timestamp at;
  at.set_seconds(utc_ns / kSecond_ns);
  at.set_nanos(static_cast<std::int32_t>(utc_ns % kSecond_ns));
  return at;
}

// Element `i` of a column of vectors with `Size` numbers each; empty if the column is shorter.
template <int Size>
std::optional<Eigen::Matrix<double, Size, 1>> element(const Numbers& column, int i) {
  if (column.size() / Size <= i) return std::nullopt;
  return Eigen::Map<const Eigen::Matrix<float, Size, 1>>(column.data() + Size * i).template cast<double>();
}

template <class Vector>
void set(Vector& to, const Eigen::Vector3d& from) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

void set(foxglove::Quaternion& to, const Eigen::Quaterniond& from) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
  to.set_w(from.w());
}

void set(foxglove::Pose& pose, const Eigen::Vector3d& position) {
  set(*pose.mutable_position(), position);
  pose.mutable_orientation()->set_w(1.0);
}

void set(foxglove::Color& colour, const Eigen::Vector3d& rgb, double alpha) {
  colour.set_r(rgb.x());
  colour.set_g(rgb.y());
  colour.set_b(rgb.z());
  colour.set_a(alpha);
}

void add_transform(foxglove::FrameTransforms& transforms, const google::protobuf::Timestamp& at,
                   const std::string& frame, const Eigen::Vector3d& position, const Eigen::Quaterniond& rotation) {
  foxglove::FrameTransform& added = *transforms.add_transforms();
  *added.mutable_timestamp() = at;
  added.set_parent_frame_id(kWorldFrame);
  added.set_child_frame_id(frame);
  set(*added.mutable_translation(), position);
  set(*added.mutable_rotation(), rotation);
}

void add_sphere(foxglove::SceneEntity& entity, const Eigen::Vector3d& position, const Eigen::Vector3d& rgb,
                double alpha) {
  foxglove::SpherePrimitive& sphere = *entity.add_spheres();
  set(*sphere.mutable_pose(), position);
  set(*sphere.mutable_size(), Eigen::Vector3d::Constant(kMarkerDiameter_m));
  set(*sphere.mutable_color(), rgb, alpha);
}

Eigen::Vector3d colour_of(const v1::Marker& marker) {
  return element<3>(marker.colour_rgb(), 0).value_or(Eigen::Vector3d::Ones());
}

void add_markers(foxglove::SceneEntity& entity, const v1::LabelledMarkers& markers, const v1::Subject& subject) {
  for (int i = 0; i < subject.markers_size() && i < markers.states_size(); ++i) {
    const bool measured = markers.states(i) == v1::MARKER_STATE_MEASURED;
    const auto position = element<3>(markers.positions_m(), i);
    if (!position || (!measured && markers.states(i) != v1::MARKER_STATE_FILLED)) continue;
    add_sphere(entity, *position, colour_of(subject.markers(i)), measured ? 1.0 : kFilledAlpha);
  }
}

std::optional<Eigen::Vector3d> joint_of(const v1::BonePoses& bones, int bone) {
  if (bone < 0 || bone >= bones.states_size()) return std::nullopt;
  if (bones.states(bone) != v1::BONE_STATE_MEASURED && bones.states(bone) != v1::BONE_STATE_FILLED) return std::nullopt;
  return element<3>(bones.world_positions_m(), bone);
}

void add_bones(foxglove::SceneEntity& entity, const v1::BonePoses& bones, const v1::Subject& subject) {
  foxglove::LinePrimitive& lines = *entity.add_lines();
  lines.set_type(foxglove::LinePrimitive::LINE_LIST);
  set(*lines.mutable_pose(), Eigen::Vector3d::Zero());
  lines.set_thickness(kBoneThickness_m);
  set(*lines.mutable_color(), Eigen::Vector3d(1.0, 1.0, 1.0), 1.0);
  for (int i = 0; i < subject.bones_size(); ++i) {
    if (!subject.bones(i).has_parent()) continue;
    const auto end = joint_of(bones, i);
    const auto start = joint_of(bones, static_cast<int>(subject.bones(i).parent()));
    if (!start || !end) continue;
    set(*lines.add_points(), *start);
    set(*lines.add_points(), *end);
  }
}

void add_name(foxglove::SceneEntity& entity, const v1::BonePoses& bones, const std::string& name) {
  const auto root = joint_of(bones, 0);
  if (!root) return;
  foxglove::TextPrimitive& text = *entity.add_texts();
  set(*text.mutable_pose(), *root + kNameAbove_m * Eigen::Vector3d::UnitZ());
  text.set_billboard(true);
  text.set_font_size(kNameHeight_m);
  set(*text.mutable_color(), Eigen::Vector3d(1.0, 1.0, 1.0), 1.0);
  text.set_text(name);
}

foxglove::SceneEntity& add_entity(foxglove::SceneUpdate& scene, const google::protobuf::Timestamp& at,
                                  const std::string& id) {
  foxglove::SceneEntity& entity = *scene.add_entities();
  *entity.mutable_timestamp() = at;
  entity.set_frame_id(kWorldFrame);
  entity.set_id(id);
  entity.mutable_lifetime()->set_seconds(1);
  return entity;
}

// The description of a subject; nullptr if `snapshot` refers to another version, or its index is not in there.
const v1::Subject* subject_of(const v1::Snapshot& snapshot, const v1::SubjectState& state,
                              const v1::Description& description) {
  const bool known = snapshot.description_version() == description.version() &&
                     state.subject() < static_cast<std::uint32_t>(description.subjects_size());
  return known ? &description.subjects(static_cast<int>(state.subject())) : nullptr;
}

}  // namespace

std::int64_t exposed_utc_ns(const v1::Snapshot& snapshot) {
  return snapshot.instants().exposed_at_ns() + snapshot.utc_minus_host_ns();
}

foxglove::FrameTransforms bones_of(const v1::Snapshot& snapshot, const v1::Description& description) {
  foxglove::FrameTransforms transforms;
  const auto at = timestamp_of(exposed_utc_ns(snapshot));
  for (const v1::SubjectState& state : snapshot.subjects()) {
    const v1::Subject* subject = subject_of(snapshot, state, description);
    if (subject == nullptr) continue;
    for (int i = 0; i < subject->bones_size(); ++i) {
      const auto position = joint_of(state.bones(), i);
      const auto rotation = element<4>(state.bones().world_rotations_xyzw(), i);
      if (!position || !rotation) continue;
      add_transform(transforms, at, subject->name() + '/' + subject->bones(i).name(), *position,
                    Eigen::Quaterniond(*rotation));
    }
  }
  return transforms;
}

foxglove::SceneUpdate scene_of(const v1::Snapshot& snapshot, const v1::Description& description) {
  foxglove::SceneUpdate scene;
  const auto at = timestamp_of(exposed_utc_ns(snapshot));
  for (const v1::SubjectState& state : snapshot.subjects()) {
    const v1::Subject* subject = subject_of(snapshot, state, description);
    if (subject == nullptr) continue;
    foxglove::SceneEntity& entity = add_entity(scene, at, subject->name());
    add_markers(entity, state.markers(), *subject);
    add_bones(entity, state.bones(), *subject);
    add_name(entity, state.bones(), subject->name());
  }
  foxglove::SceneEntity& unlabelled = add_entity(scene, at, "/unlabelled");
  for (int i = 0; i < snapshot.unlabelled().positions_m_size() / 3; ++i) {
    add_sphere(unlabelled, *element<3>(snapshot.unlabelled().positions_m(), i),
               Eigen::Vector3d::Constant(kUnlabelledGrey), 1.0);
  }
  return scene;
}

foxglove::FrameTransforms cameras_of(const v1::Description& description, std::int64_t utc_ns) {
  foxglove::FrameTransforms transforms;
  for (const v1::Camera& camera : description.cameras()) {
    const v1::Quaternion& q = camera.camera_from_world_rotation();
    const v1::Vector3& t = camera.camera_from_world_translation_m();
    const Eigen::Quaterniond world_from_camera = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).conjugate();
    add_transform(transforms, timestamp_of(utc_ns), "camera/" + camera.name(),
                  -(world_from_camera * Eigen::Vector3d(t.x(), t.y(), t.z())), world_from_camera);
  }
  return transforms;
}

foxglove::CompressedImage image_of(const v1::Preview& preview, const std::string& name,
                                   std::int64_t utc_minus_host_ns) {
  foxglove::CompressedImage image;
  *image.mutable_timestamp() = timestamp_of(preview.exposed_at_ns() + utc_minus_host_ns);
  image.set_frame_id("camera/" + name);
  image.set_format("jpeg");
  image.set_data(preview.jpeg());
  return image;
}

}  // namespace mocap::web
