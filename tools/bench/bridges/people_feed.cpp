#include "bench/bridges/people_feed.h"

#include <fmt/format.h>

#include <utility>

#include "base/time.h"
#include "bench/bridges/frame_number.h"

namespace mocap::bench {
namespace {

constexpr double kHips_m = 0.95;   // height of the root
constexpr double kApart_m = 1.0;   // between two people
constexpr double kResidual = 0.2;  // of a marker, px

SubjectPose stand(const Skeleton& skeleton, SubjectId id) {
  SubjectPose pose;
  pose.subject = id;
  for (const Bone& bone : skeleton.bones) {
    BonePose& into = pose.bones.push_back({});
    into.state = BoneState::Measured;
    into.confidence = 1.0F;
    if (bone.parent < 0) {
      into.parent_from_bone.position = {0.0, kApart_m * id.value, kHips_m};
      into.world_from_bone = into.parent_from_bone;
    } else {
      into.parent_from_bone.position = bone.rest_offset_m;
      into.world_from_bone = pose.bones[static_cast<std::size_t>(bone.parent)].world_from_bone * into.parent_from_bone;
    }
  }
  return pose;
}

SubjectLabels label(const MarkerSet& set, const SubjectPose& pose) {
  SubjectLabels labels;
  labels.subject = pose.subject;
  labels.phase = SubjectPhase::Tracking;
  for (std::uint32_t i = 0; i < set.markers.size(); ++i) {
    LabelledMarker& marker = labels.markers.push_back({});
    marker.state = LabelState::Measured;
    marker.position.v =
        pose.bones[static_cast<std::size_t>(set.markers[i].bone)].world_from_bone * set.markers[i].offset_m;
    marker.residual_px = kResidual;
    marker.cameras = 4;
    marker.confidence = 1.0F;
    marker.track = TrackId{pose.subject.value * 100 + i};
  }
  return labels;
}

}  // namespace

Snapshot people_at_origin(const Description& description) {
  Snapshot snapshot;
  snapshot.description_version = description.version;
  for (std::uint32_t i = 0; i < description.subjects.size(); ++i) {
    const MarkerSet& set = description.subjects[i].marker_set;
    const SubjectPose& pose = snapshot.poses.push_back(stand(set.skeleton, SubjectId{i}));
    snapshot.labels.push_back(label(set, pose));
  }
  return snapshot;
}

void move_people(const Snapshot& at_origin, double x_m, Snapshot& into) {
  for (std::size_t i = 0; i < at_origin.poses.size(); ++i) {
    SubjectPose& pose = into.poses[i];
    for (std::size_t bone = 0; bone < pose.bones.size(); ++bone) {
      pose.bones[bone].world_from_bone.position.x() = at_origin.poses[i].bones[bone].world_from_bone.position.x() + x_m;
    }
    pose.bones[0].parent_from_bone = pose.bones[0].world_from_bone;
    for (std::size_t marker = 0; marker < into.labels[i].markers.size(); ++marker) {
      into.labels[i].markers[marker].position.v.x() = at_origin.labels[i].markers[marker].position.v.x() + x_m;
    }
  }
}

Result<PeopleFeed> PeopleFeed::open(const MarkerSet& set, int people, double rate_hz) {
  auto publisher =
      wire::ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*", .subjects = static_cast<std::size_t>(people)});
  if (!publisher) return publisher.error();
  Description description;
  description.producer = "mocap-bench";
  description.session_id = "bridges";
  description.nominal_rate_hz = rate_hz;
  for (int i = 1; i <= people; ++i) description.subjects.push_back({fmt::format("person{}", i), set});
  if (const Status described = (*publisher)->describe(description); !described) return described.error();
  return PeopleFeed(*std::move(publisher), people_at_origin(description));
}

Status PeopleFeed::send(std::uint64_t number, const FrameTimes& times) {
  move_people(at_origin_, kStep_m * static_cast<double>(number), sent_);
  const Timestamp exposed = from_ns(times.exposed_ns(number));
  sent_.number = number;
  sent_.instants = {exposed, exposed, exposed, exposed, std::nullopt};
  return publisher_->publish(sent_);
}

}  // namespace mocap::bench
