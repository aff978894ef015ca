#pragma once

#include <algorithm>
#include <cstdint>
#include <random>

#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap::wire::testing {

/// Random models whose numbers the wire format represents exactly: single precision, whole percents, thousandths of a
/// pixel.
class RandomModel {
 public:
  explicit RandomModel(std::uint32_t seed) : random_(seed) {}

  std::uint32_t up_to(std::uint32_t most) { return std::uniform_int_distribution<std::uint32_t>(0, most)(random_); }
  bool coin() { return up_to(1) == 1; }
  double number() { return static_cast<double>(std::uniform_real_distribution<float>(-5.0F, 5.0F)(random_)); }
  float share() { return static_cast<float>(up_to(100)) / 100.0F; }
  Eigen::Vector3d vector() {
    const double x = number(), y = number(), z = number();
    return {x, y, z};
  }
  Eigen::Quaterniond rotation() {
    Eigen::Quaterniond q(number(), number(), number(), number() + 11.0);
    q.normalize();
    return Eigen::Quaterniond(q.cast<float>().cast<double>());
  }
  double residual_px() { return 1e-3 * up_to(20000); }
  TrackId track() { return coin() ? TrackId{up_to(0xFFFF'FFFEU)} : TrackId{}; }

  Snapshot snapshot(std::uint32_t most = 40) {
    Snapshot s;
    s.number = (std::uint64_t{up_to(0xFFFF'FFFFU)} << 32U) + up_to(0xFFFF'FFFFU);
    s.description_version = up_to(1000);
    s.instants = instants();
    if (coin()) s.timecode = timecode();
    s.expected_views = up_to(kMaxCameras);
    for (std::uint32_t i = 0, n = up_to(std::min<std::uint32_t>(most, kMaxCameras)); i < n; ++i) {
      s.views.push_back({CameraId{i}, std::uint64_t{up_to(0xFFFF'FFFFU)} << 20U,
                         Duration(static_cast<std::int64_t>(up_to(2000)) - 1000), up_to(512)});
    }
    for (std::uint32_t i = 0, n = up_to(3); i < n; ++i) {
      SubjectLabels& labels = s.labels.push_back({});
      labels.subject = SubjectId{i};
      labels.phase = static_cast<SubjectPhase>(up_to(2));
      for (std::uint32_t m = 0, markers = up_to(std::min<std::uint32_t>(most, kMaxLabels)); m < markers; ++m) {
        labels.markers.push_back(label());
      }
      if (coin()) s.poses.push_back(pose(SubjectId{i}, std::min<std::uint32_t>(most, kMaxBones)));
    }
    for (std::uint32_t i = 0, n = up_to(most); i < n; ++i) {
      s.unlabelled.push_back({track(), WorldPoint{vector()}, residual_px(), up_to(64)});
    }
    return s;
  }

  LabelledMarker label() {
    LabelledMarker marker;
    marker.state = static_cast<LabelState>(up_to(2));
    if (marker.state == LabelState::Lost) return marker;
    marker.position.v = vector();
    marker.residual_px = residual_px();
    marker.cameras = up_to(64);
    marker.confidence = share();
    marker.track = track();
    return marker;
  }

  SubjectPose pose(SubjectId subject, std::uint32_t most) {
    SubjectPose pose;
    pose.subject = subject;
    pose.residual_m = number();
    pose.smoothing_delay_s = number();
    for (std::uint32_t b = 0, bones = up_to(most); b < bones; ++b) {
      BonePose& bone = pose.bones.push_back({});
      bone.state = static_cast<BoneState>(up_to(2));
      if (bone.state == BoneState::Lost) continue;
      bone.world_from_bone = {vector(), rotation()};
      bone.parent_from_bone = {vector(), rotation()};
      bone.confidence = share();
      bone.velocity_m_s = vector();
      bone.spin_rad_s = vector();
    }
    return pose;
  }

  Timecode timecode() {
    Timecode format;
    format.frames_per_second = coin() ? 30 : 24 + up_to(1);
    format.drop_frame = format.frames_per_second == 30 && coin();
    format.fractional = coin();
    Timecode timecode = timecode_of(up_to(2'000'000), format);
    timecode.subframe = up_to(3);
    return timecode;
  }

  Instants instants() {
    const auto instant = [&] { return from_ns(std::int64_t{up_to(0xFFFF'FFFFU)} * 1000); };
    const auto perhaps = [&] { return coin() ? std::optional<Timestamp>(instant()) : std::nullopt; };
    Instants all;
    all.exposed_at = instant();
    all.received_at = perhaps();
    all.detected_at = perhaps();
    all.fused_at = perhaps();
    all.sent_at = perhaps();
    return all;
  }

 private:
  std::mt19937 random_;
};

}  // namespace mocap::wire::testing
