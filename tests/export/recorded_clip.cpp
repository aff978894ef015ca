#include "export/recorded_clip.h"

#include <cmath>

#include "base/expects.h"
#include "support/typical_snapshot.h"
#include "take/take_writer.h"

namespace mocap::exports::test {
namespace {

Description description_of(const Clip& clip, const std::vector<std::string>& names) {
  Description description = support::typical_description({12, 5, 2});  // for its cameras
  description.producer = clip.producer;
  description.nominal_rate_hz = clip.rate.hz();
  description.subjects.clear();
  for (std::size_t s = 0; s < clip.subjects.size(); ++s) {
    description.subjects.push_back(clip.subjects[s].subject);
    description.subjects.back().name = names[s];
  }
  return description;
}

SubjectLabels labels_of(const ClipSubject& subject, SubjectId id, const std::vector<Pose>& world) {
  SubjectLabels labels;
  labels.subject = id;
  labels.phase = SubjectPhase::Tracking;
  for (const MarkerOnBone& on_bone : subject.subject.marker_set.markers) {
    LabelledMarker marker;
    const Eigen::Vector3d at = world[static_cast<std::size_t>(on_bone.bone)] * on_bone.offset_m;
    if (at.allFinite()) {
      marker.state = LabelState::Measured;
      marker.position.v = at;
      marker.cameras = 2;
    }
    labels.markers.push_back(marker);
  }
  return labels;
}

SubjectPose pose_of(const ClipSubject& subject, SubjectId id, std::size_t frame, const std::vector<Pose>& world) {
  SubjectPose pose;
  pose.subject = id;
  for (std::size_t b = 0; b < world.size(); ++b) {
    const BoneSample& sample = subject.bones[frame * world.size() + b];
    BonePose bone;
    if (sample.state != BoneState::Lost) bone.parent_from_bone = sample.parent_from_bone;
    if (sample.state != BoneState::Lost) bone.state = sample.state;
    if (world[b].position.allFinite()) bone.world_from_bone = world[b];
    pose.bones.push_back(bone);
  }
  return pose;
}

Snapshot snapshot_of(const Clip& clip, std::size_t frame) {
  Snapshot snapshot;
  snapshot.number = frame;
  snapshot.description_version = 1;
  snapshot.instants.exposed_at =
      from_ns(5'000'000'000 + std::llround(1e9 * clip.rate.time_s(static_cast<std::int64_t>(frame))));
  for (std::size_t s = 0; s < clip.subjects.size(); ++s) {
    const SubjectId id{static_cast<std::uint32_t>(s)};
    const std::vector<Pose> world = world_poses(clip.subjects[s], frame);
    snapshot.labels.push_back(labels_of(clip.subjects[s], id, world));
    snapshot.poses.push_back(pose_of(clip.subjects[s], id, frame, world));
  }
  return snapshot;
}

}  // namespace

std::vector<Pose> world_poses(const ClipSubject& subject, std::size_t frame) {
  const std::vector<Bone>& bones = subject.subject.marker_set.skeleton.bones;
  std::vector<Pose> world;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const Pose& local = subject.bones[frame * bones.size() + b].parent_from_bone;
    world.push_back(bones[b].parent < 0 ? local : world[static_cast<std::size_t>(bones[b].parent)] * local);
  }
  return world;
}

void record(const Clip& clip, const std::vector<std::string>& names, const std::filesystem::path& path) {
  take::TakeStart start;
  start.info.name = path.stem().string();
  start.info.producer = clip.producer;
  start.info.started_at = snapshot_of(clip, 0).instants.exposed_at;
  start.description = description_of(clip, names);
  auto writer = take::TakeWriter::create(path, start, {});
  MOCAP_EXPECTS(writer.has_value());
  for (std::size_t f = 0; f < clip.frames; ++f) {
    MOCAP_EXPECTS((*writer)->append(snapshot_of(clip, f)).has_value());
  }
  take::TakeInfo end = start.info;
  end.ended_at = snapshot_of(clip, clip.frames - 1).instants.exposed_at;
  MOCAP_EXPECTS((*writer)->finish(end).has_value());
}

}  // namespace mocap::exports::test
