#include "chaos/invariants.h"

#include <fmt/format.h>
#include <google/protobuf/util/message_differencer.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "take/take_edit.h"
#include "take/take_reader.h"
#include "wire/codec/decode.h"
#include "wire/codec/encode.h"
#include "wire/codec/snapshot_encoder.h"

namespace mocap::chaos {
namespace {

constexpr std::uint64_t kQueued = 8;     // images of one camera that may wait in the aligner
constexpr double kUnit = 1e-6;           // deviation of the norm of a rotation
constexpr std::size_t kJudgedBones = 8;  // a subject with fewer bones in sight is not judged
constexpr double kSeenMarkers = 0.8;     // share of the markers that two cameras must see

bool is_unit(const Eigen::Quaterniond& rotation) {
  return rotation.coeffs().allFinite() && std::abs(rotation.norm() - 1.0) < kUnit;
}

Finding bad_marker(const LabelledMarker& marker) {
  if (marker.state == LabelState::Lost) return std::nullopt;
  if (!marker.position.v.allFinite()) return "position";
  if (!marker.covariance_m2.allFinite()) return "covariance";
  if (!std::isfinite(marker.residual_px) || !std::isfinite(marker.confidence)) return "residual or confidence";
  return std::nullopt;
}

Finding bad_bone(const BonePose& bone) {
  if (bone.state == BoneState::Lost) return std::nullopt;
  for (const Pose* pose : {&bone.world_from_bone, &bone.parent_from_bone}) {
    if (!pose->position.allFinite() || !is_unit(pose->rotation)) return "pose";
  }
  if (!bone.velocity_m_s.allFinite() || !bone.spin_rad_s.allFinite()) return "velocity";
  if (!std::isfinite(bone.confidence)) return "confidence";
  return std::nullopt;
}

std::string bytes_of(const Snapshot& snapshot) {
  v1::Snapshot message;
  wire::encode(snapshot, message);
  return message.SerializeAsString();
}

}  // namespace

Finding all_numbers_finite(const Snapshot& snapshot) {
  for (const SubjectLabels& labels : snapshot.labels) {
    for (std::size_t m = 0; m < labels.markers.size(); ++m) {
      const Finding bad = bad_marker(labels.markers[m]);
      if (bad) return fmt::format("{} of marker {} of subject {}", *bad, m, labels.subject.value);
    }
  }
  for (const SubjectPose& pose : snapshot.poses) {
    if (!std::isfinite(pose.residual_m)) return fmt::format("residual of subject {}", pose.subject.value);
    for (std::size_t b = 0; b < pose.bones.size(); ++b) {
      const Finding bad = bad_bone(pose.bones[b]);
      if (bad) return fmt::format("{} of bone {} of subject {}", *bad, b, pose.subject.value);
    }
  }
  for (const UnlabelledMarker& marker : snapshot.unlabelled) {
    if (!marker.position.v.allFinite() || !std::isfinite(marker.residual_px)) {
      return fmt::format("unlabelled marker of track {}", marker.track.value);
    }
  }
  return std::nullopt;
}

Finding time_goes_on(const Snapshot& before, const Snapshot& now) {
  if (now.number <= before.number) return fmt::format("set {} follows set {}", now.number, before.number);
  if (now.instants.exposed_at > before.instants.exposed_at) return std::nullopt;
  return fmt::format("set {} was exposed {} ns before set {}", now.number,
                     (before.instants.exposed_at - now.instants.exposed_at).count(), before.number);
}

Finding labels_are_unique(const Snapshot& snapshot) {
  std::set<std::uint32_t> subjects, tracks;
  for (const SubjectLabels& labels : snapshot.labels) {
    if (!subjects.insert(labels.subject.value).second) {
      return fmt::format("subject {} occurs twice", labels.subject.value);
    }
    for (const LabelledMarker& marker : labels.markers) {
      if (marker.state != LabelState::Measured || !marker.track.names_something()) continue;
      if (!tracks.insert(marker.track.value).second) return fmt::format("track {} has two labels", marker.track.value);
    }
  }
  for (const UnlabelledMarker& marker : snapshot.unlabelled) {
    if (tracks.contains(marker.track.value)) return fmt::format("track {} has a label and none", marker.track.value);
  }
  return std::nullopt;
}

Finding fits_description(const Snapshot& snapshot, const Description& description) {
  if (snapshot.description_version != description.version) {
    return fmt::format("the snapshot refers to description {}, the last one sent is {}", snapshot.description_version,
                       description.version);
  }
  for (const SubjectLabels& labels : snapshot.labels) {
    if (labels.subject.value >= description.subjects.size()) return "a subject that the description lacks";
    const std::size_t wanted = description.subjects[labels.subject.value].marker_set.markers.size();
    if (labels.markers.empty() || labels.markers.size() == wanted) continue;
    return fmt::format("{} markers, expected {}", labels.markers.size(), wanted);
  }
  for (const SubjectPose& pose : snapshot.poses) {
    if (pose.subject.value >= description.subjects.size()) return "a pose of a subject that the description lacks";
    const std::size_t wanted = description.subjects[pose.subject.value].marker_set.skeleton.bones.size();
    if (pose.bones.empty() || pose.bones.size() == wanted) continue;
    return fmt::format("{} bones, expected {}", pose.bones.size(), wanted);
  }
  return std::nullopt;
}

Finding images_are_counted(const FrameCounts& counts, std::size_t cameras, bool ended) {
  const std::uint64_t known = counts.used + counts.dropped + counts.waiting;
  const std::uint64_t most = ended ? 0 : kQueued * cameras;
  if (counts.received >= known && counts.received - known <= most) return std::nullopt;
  return fmt::format("{} images received; {} used, {} dropped, {} wait, expected at most {} others", counts.received,
                     counts.used, counts.dropped, counts.waiting, most);
}

Finding snapshot_survives_wire(const Snapshot& snapshot) {
  const std::string sent = bytes_of(snapshot);
  wire::SnapshotEncoder encoder;
  const std::span<const std::uint8_t> direct = encoder.encode("", snapshot, {}, {});
  if (!std::ranges::equal(direct, sent, [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); })) {
    return "the two encoders give different bytes";
  }
  v1::Snapshot message;
  if (!message.ParseFromString(sent)) return "the bytes are no message";
  const Result<Snapshot> received = wire::decode(message);
  if (!received) return received.error().message;
  if (bytes_of(*received) != sent) return "the decoded snapshot gives other bytes";
  return std::nullopt;
}

Finding description_survives_wire(const Description& description) {
  const std::string sent = wire::encode(description).SerializeAsString();
  v1::Description message;
  if (!message.ParseFromString(sent)) return "the bytes are no message";
  const Result<Description> received = wire::decode(message);
  if (!received) return received.error().message;
  // A rotation is a matrix here and a quaternion on the wire: its last digits may change.
  google::protobuf::util::MessageDifferencer compare;
  compare.set_float_comparison(google::protobuf::util::MessageDifferencer::APPROXIMATE);
  std::string difference;
  compare.ReportDifferencesToString(&difference);
  if (!compare.Compare(message, wire::encode(*received))) return "the decoded description differs: " + difference;
  return std::nullopt;
}

Finding memory_is_bounded(std::int64_t growth_bytes) {
  if (growth_bytes <= kGrowth_bytes) return std::nullopt;
  return fmt::format("the steps keep {} bytes, expected at most {}", growth_bytes, kGrowth_bytes);
}

Finding take_is_whole(const std::filesystem::path& take) {
  const Result<take::TakeReader> reader = take::TakeReader::open(take);
  if (!reader) return reader.error().message;
  if (reader->cut_off()) return fmt::format("'{}' has no end", take.string());
  const auto damages = take::verify_take(take);
  if (!damages) return damages.error().message;
  if (!damages->empty()) return fmt::format("'{}': {}", take.string(), damages->front().what);
  return std::nullopt;
}

Finding skeleton_is_right(const Snapshot& snapshot, const scoring::EvalFrame& truth, std::uint32_t subject,
                          std::uint32_t performer) {
  std::size_t markers = 0, seen = 0;
  for (const scoring::NamedMarker& marker : truth.markers) {
    markers += marker.subject == performer ? 1 : 0;
    seen += marker.subject == performer && marker.cameras >= 2 ? 1 : 0;
  }
  if (static_cast<double>(seen) < kSeenMarkers * static_cast<double>(markers)) return std::nullopt;
  const auto pose = std::ranges::find(snapshot.poses, SubjectId{subject}, &SubjectPose::subject);
  const bool has_bones = pose != snapshot.poses.end() && !pose->bones.empty();
  double sum_m2 = 0.0;
  std::size_t bones = 0;
  for (const scoring::PosedBone& bone : truth.bones) {
    if (bone.subject != performer || bone.state != BoneState::Measured) continue;
    ++bones;
    if (has_bones) sum_m2 += (pose->bones[bone.bone].world_from_bone.position - bone.position_m).squaredNorm();
  }
  if (bones < kJudgedBones) return std::nullopt;
  if (!has_bones) return fmt::format("subject {} has no skeleton", subject);
  const double rms_m = std::sqrt(sum_m2 / static_cast<double>(bones));
  if (rms_m <= kRight_m) return std::nullopt;
  return fmt::format("the bones of subject {} are {:.0f} mm rms off, expected at most {:.0f} mm", subject, 1e3 * rms_m,
                     1e3 * kRight_m);
}

}  // namespace mocap::chaos
