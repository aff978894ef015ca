#include "lib/offline/two_way.h"

#include <algorithm>

#include "lib/offline/same_subject.h"

namespace mocap::offline {
namespace {

double distance_m(const WorldPoint& a, const WorldPoint& b) { return (a.v - b.v).norm(); }

// The index of the entry of a subject; size(): none.
template <class Entries>
std::size_t index_of(const Entries& entries, SubjectId subject) {
  const auto found = std::ranges::find_if(entries, [&](const auto& entry) { return entry.subject == subject; });
  return static_cast<std::size_t>(found - entries.begin());
}

bool is_taken(const Snapshot& snapshot, const WorldPoint& at) {
  return std::ranges::any_of(snapshot.labels, [&](const SubjectLabels& subject) {
    return std::ranges::any_of(subject.markers, [&](const LabelledMarker& marker) {
      return marker.state == LabelState::Measured && distance_m(marker.position, at) < kSameMarker_m;
    });
  });
}

// Returns a label of the backward pass. A measured label gets the track of the unlabelled marker that the forward pass
// has at its position; this marker is then removed from `from.unlabelled`.
LabelledMarker take_over_label(LabelledMarker marker, Snapshot& from) {
  marker.track = {};
  if (marker.state != LabelState::Measured) return marker;
  const auto nearest = std::ranges::min_element(
      from.unlabelled, {}, [&](const UnlabelledMarker& other) { return distance_m(other.position, marker.position); });
  if (nearest == from.unlabelled.end() || distance_m(nearest->position, marker.position) >= kSameMarker_m) {
    return marker;
  }
  marker.track = nearest->track;
  const auto kept = std::move(nearest + 1, from.unlabelled.end(), nearest);
  while (from.unlabelled.end() != kept) from.unlabelled.pop_back();
  return marker;
}

}  // namespace

// The only subject cannot be exchanged with another one: it is trusted as soon as the backward pass finds it, unless
// the forward pass has it elsewhere at the same time.
bool TwoWay::judge(const SubjectLabels& forward, const SubjectLabels& backward) {
  const bool is_alone = subjects_.size() == 1;
  bool& trusted = trusted_.try_emplace(forward.subject.value, is_alone).first->second;
  if (backward.phase != SubjectPhase::Tracking) {
    trusted = is_alone;
    return false;
  }
  if (forward.phase != SubjectPhase::Tracking) return trusted;
  int both = 0, same = 0;
  for (std::size_t m = 0; m < std::min(forward.markers.size(), backward.markers.size()); ++m) {
    const LabelledMarker &one = forward.markers[m], &other = backward.markers[m];
    if (one.state != LabelState::Measured || other.state != LabelState::Measured) continue;
    ++both;
    same += distance_m(one.position, other.position) < kSameMarker_m ? 1 : 0;
  }
  if (both >= kFewestLabels) trusted = same >= kAgreeingShare * both;
  return trusted;
}

Snapshot TwoWay::join(const Pass& forward, const Pass& backward) {
  Snapshot joined = forward.snapshot;
  for (std::size_t i = 0; i < forward.snapshot.labels.size(); ++i) {
    const SubjectLabels& own = forward.snapshot.labels[i];
    const std::size_t other = index_of(backward.snapshot.labels, own.subject);
    if (other == backward.snapshot.labels.size()) continue;
    if (!judge(own, backward.snapshot.labels[other])) continue;
    if (own.phase != SubjectPhase::Tracking) {
      start_subject(i, backward, other, joined);
      continue;
    }
    fill_labels(backward.snapshot.labels[other], forward.ages.labels[i], backward.ages.labels[other], joined.labels[i],
                joined);
    const std::size_t pose = index_of(joined.poses, own.subject);
    const std::size_t from = index_of(backward.snapshot.poses, own.subject);
    if (pose == joined.poses.size() || from == backward.snapshot.poses.size()) continue;
    fill_bones(backward.snapshot.poses[from], forward.ages.bones[pose], backward.ages.bones[from], joined.poses[pose]);
  }
  return joined;
}

// Takes a subject over from the backward pass. Does nothing if fewer than kFewestLabels of its labels were measured
// (the subject is then mostly predicted), or if a measured label of `into` is at one of its markers.
void TwoWay::start_subject(std::size_t index, const Pass& backward, std::size_t from, Snapshot& into) const {
  const SubjectLabels& found = backward.snapshot.labels[from];
  const auto is_measured = [](const LabelledMarker& marker) { return marker.state == LabelState::Measured; };
  if (std::ranges::count_if(found.markers, is_measured) < kFewestLabels) return;
  for (const LabelledMarker& marker : found.markers) {
    if (is_measured(marker) && is_taken(into, marker.position)) return;
  }
  SubjectLabels started = found;
  for (LabelledMarker& marker : started.markers) marker = take_over_label(marker, into);
  into.labels[index] = started;
  const std::size_t pose = index_of(backward.snapshot.poses, found.subject);
  if (pose == backward.snapshot.poses.size()) return;
  const std::size_t own = index_of(into.poses, found.subject);
  if (own < into.poses.size()) {
    into.poses[own] = backward.snapshot.poses[pose];
  } else {
    into.poses.push_back(backward.snapshot.poses[pose]);
  }
}

void TwoWay::fill_labels(const SubjectLabels& from, const std::vector<float>& forward_ages,
                         const std::vector<float>& backward_ages, SubjectLabels& into, Snapshot& all) const {
  for (std::size_t m = 0; m < std::min(into.markers.size(), from.markers.size()); ++m) {
    LabelledMarker& own = into.markers[m];
    const LabelledMarker& other = from.markers[m];
    if (own.state == LabelState::Measured || other.state == LabelState::Lost) continue;
    if (other.state == LabelState::Measured) {
      if (!is_taken(all, other.position)) own = take_over_label(other, all);
    } else if (own.state == LabelState::Filled && own.cameras == 0 && other.cameras == 0) {
      const double share = forward_share(forward_ages[m], backward_ages[m]);
      own.position.v = share * own.position.v + (1.0 - share) * other.position.v;
    }
  }
}

// Lengths of filled bones are kept: only rotations are blended, and joints follow from the root on.
void TwoWay::fill_bones(const SubjectPose& from, const std::vector<float>& forward_ages,
                        const std::vector<float>& backward_ages, SubjectPose& into) const {
  const std::vector<Bone>& bones = subjects_[into.subject.value].marker_set.skeleton.bones;
  if (into.bones.size() != bones.size() || from.bones.size() != bones.size()) return;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    BonePose& own = into.bones[b];
    const BonePose& other = from.bones[b];
    const bool is_root = bones[b].parent < 0;
    if (own.state == BoneState::Filled && other.state != BoneState::Lost) {
      const double share = forward_share(forward_ages[b], backward_ages[b]);
      Pose& pose = own.world_from_bone;
      pose.rotation = other.world_from_bone.rotation.slerp(share, pose.rotation);
      if (is_root) pose.position = share * pose.position + (1.0 - share) * other.world_from_bone.position;
      own.velocity_m_s = share * own.velocity_m_s + (1.0 - share) * other.velocity_m_s;
      own.spin_rad_s = share * own.spin_rad_s + (1.0 - share) * other.spin_rad_s;
    }
    if (is_root) {
      own.parent_from_bone = own.world_from_bone;
      continue;
    }
    const Pose& parent = into.bones[static_cast<std::size_t>(bones[b].parent)].world_from_bone;
    if (own.state == BoneState::Filled) own.world_from_bone.position = parent * own.parent_from_bone.position;
    own.parent_from_bone = parent.inverse() * own.world_from_bone;
  }
}

}  // namespace mocap::offline
