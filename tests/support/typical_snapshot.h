#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <random>
#include <string>

#include "model/description.h"
#include "model/snapshot.h"

namespace mocap::support {

struct TypicalSize {
  std::uint32_t markers = 60;
  std::uint32_t bones = 24;
  std::uint32_t cameras = 8;
};

/// A description with one subject: its bones form a chain, and the markers are distributed over the bones in turn.
inline Description typical_description(TypicalSize size = {}) {
  Description description;
  description.producer = "mocapd test";
  description.session_id = "0123456789abcdef";
  description.nominal_rate_hz = 120.0;
  for (std::uint32_t i = 0; i < size.cameras; ++i) {
    CameraModel camera;
    camera.name = "camera" + std::to_string(i);
    camera.width_px = 1280;
    camera.height_px = 1024;
    description.cameras.push_back(camera);
  }
  Subject subject;
  subject.name = "actor";
  subject.marker_set.name = "typical";
  subject.marker_set.skeleton.name = "row";
  for (std::uint32_t i = 0; i < size.bones; ++i) {
    Bone bone;
    bone.name = "Bone" + std::to_string(i);
    bone.parent = static_cast<int>(i) - 1;
    bone.rest_offset_m = {0.0, 0.0625 * (i % 3), 0.125};
    subject.marker_set.skeleton.bones.push_back(bone);
  }
  for (std::uint32_t i = 0; i < size.markers; ++i) {
    subject.marker_set.markers.push_back(
        {"Marker" + std::to_string(i), static_cast<int>(i % size.bones), {0.03, 0.01, 0.05}, {1.0F, 0.0F, 0.0F}});
  }
  description.subjects.push_back(subject);
  return description;
}

/// A snapshot in which all markers and bones are measured, ten days after the start of the host, so that the encoded
/// numbers are as long as in a real session.
inline Snapshot typical_snapshot(const Description& description, std::uint32_t seed = 1) {
  std::mt19937 random(seed);
  const auto number = [&](double most) { return std::uniform_real_distribution<double>(-most, most)(random); };
  const auto vector = [&](double most) {
    const double x = number(most), y = number(most), z = number(most);
    return Eigen::Vector3d(x, y, z);
  };
  Snapshot snapshot;
  snapshot.number = 20'000'000 + seed;
  snapshot.description_version = description.version;
  const std::int64_t at = 864'000'123'456'789;
  snapshot.instants = {from_ns(at), from_ns(at + 4'000'000), from_ns(at + 4'300'000), from_ns(at + 4'900'000),
                       std::nullopt};
  snapshot.expected_views = static_cast<std::uint32_t>(description.cameras.size());
  for (std::uint32_t i = 0; i < description.cameras.size(); ++i) {
    snapshot.views.push_back({CameraId{i}, 20'000'000 + i, Duration(static_cast<std::int64_t>(number(20'000.0))), 61});
  }
  const MarkerSet& set = description.subjects[0].marker_set;
  SubjectLabels& labels = snapshot.labels.push_back({});
  labels.subject = SubjectId{0};
  labels.phase = SubjectPhase::Tracking;
  for (std::uint32_t i = 0; i < set.markers.size(); ++i) {
    LabelledMarker& marker = labels.markers.push_back({});
    marker.state = LabelState::Measured;
    marker.position.v = vector(4.0);
    marker.residual_px = 0.2 + number(0.15);
    marker.cameras = 5;
    marker.confidence = 0.98F;
    marker.track = TrackId{4000 + 7 * i};
  }
  SubjectPose& pose = snapshot.poses.push_back({});
  pose.subject = SubjectId{0};
  pose.residual_m = 0.0035;
  for (const Bone& bone : set.skeleton.bones) {
    BonePose& into = pose.bones.push_back({});
    into.state = BoneState::Measured;
    into.confidence = 0.97F;
    const Eigen::Quaterniond turn = Eigen::Quaterniond(1.0 + number(0.3), number(0.5), number(0.5), number(0.5));
    into.parent_from_bone = {bone.parent < 0 ? vector(2.0) : bone.rest_offset_m, turn.normalized()};
    into.world_from_bone =
        bone.parent < 0 ? into.parent_from_bone
                        : pose.bones[static_cast<std::size_t>(bone.parent)].world_from_bone * into.parent_from_bone;
    into.velocity_m_s = vector(2.0);
    into.spin_rad_s = vector(3.0);
  }
  return snapshot;
}

}  // namespace mocap::support
