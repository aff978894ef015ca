// The part of SubjectLabeller that chooses the limb to be read anew, and the places where its markers may be.

#include <algorithm>

#include "label/subject_labeller.h"

namespace mocap::label {
namespace {

// A track farther from where a marker is thought to be is not that marker, unless its limb was misread or nobody sees
// any of its bone: then it may be anywhere that the limb reaches.
constexpr double kCandidateRadius_m = 0.3;
constexpr double kLimbReach_m = 0.6;
// A name that was given in the last ten sets or so must still be the clear reading when its limb is read anew.
constexpr float kEstablishedConfidence = 0.85F;
// Young tracks of fewer cameras may be where rays meet by chance.
constexpr std::uint32_t kLeastCameras = 3;

}  // namespace

// Counts, by bone, the names that are missing while strays stand near.
void SubjectLabeller::count_unexplained(LabelledTracks& tracks) {
  for (std::size_t i = 0; i < tracks.trusted.size(); ++i) tracks.trusted[i] = tracks.labelled[i];
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    if (memories_[m].index >= 0) tracks.trusted[static_cast<std::size_t>(memories_[m].index)] = accepted_[m];
  }
  unassigned_tracks_.clear();
  for (std::size_t i = 0; i < tracks.labelled.size(); ++i) {
    if (is_unassigned_track(i, tracks)) unassigned_tracks_.push_back(static_cast<int>(i));
  }
  std::fill(unexplained_.begin(), unexplained_.end(), 0);
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    if (accepted_[m]) continue;
    const auto bone = static_cast<std::size_t>(set_.markers[m].bone);
    const double radius_m = unreliable_[bone] != 0 || has_no_trusted_label(bone) ? kLimbReach_m : kCandidateRadius_m;
    const Eigen::Vector3d at = body_.predicted_position(m);
    const bool is_near = std::any_of(unassigned_tracks_.begin(), unassigned_tracks_.end(), [&](int track) {
      return (tracks[track].position.v - at).squaredNorm() < radius_m * radius_m;
    });
    if (is_near) ++unexplained_[bone];
  }
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    if (is_contested(m)) ++unexplained_[static_cast<std::size_t>(set_.markers[m].bone)];
  }
  for (std::size_t b = 0; b < unexplained_.size(); ++b) {
    if (unexplained_[b] == 0) unreliable_[b] = 0;
  }
}

// -1: none that is not at rest.
int SubjectLabeller::worst_bone() const {
  int most = -1;
  for (std::size_t b = 0; b < unexplained_.size(); ++b) {
    if (unexplained_[b] == 0 || cooldown_[b] > 0) continue;
    if (most < 0 || unexplained_[b] > unexplained_[static_cast<std::size_t>(most)]) most = static_cast<int>(b);
  }
  return most;
}

bool SubjectLabeller::add_bone(std::size_t bone) {
  if (in_limb_[bone]) return true;
  std::size_t count = 0;
  for (const MarkerOnBone& marker : set_.markers) count += marker.bone == static_cast<int>(bone) ? 1 : 0;
  if (limb_.label_count() + count > DistanceConstraintMatcher::kMaxLimbLabels) return false;
  in_limb_[bone] = true;
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    if (set_.markers[m].bone == static_cast<int>(bone)) (void)limb_.add_label(m);
  }
  return true;
}

// Whether a bone has names and none of them is believed.
bool SubjectLabeller::has_no_trusted_label(std::size_t bone) const {
  bool any = false;
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    if (set_.markers[m].bone != static_cast<int>(bone)) continue;
    if (accepted_[m]) return false;
    any = true;
  }
  return any;
}

// The bone, the bones in trouble that hang together with it, and those that hang on to these. Nobody knows where a bone
// is whose names are missing, and that hangs on one whose names are missing, too.
bool SubjectLabeller::gather_limb(std::size_t seed, const LabelledTracks& tracks) {
  const auto& bones = set_.skeleton.bones;
  limb_.clear();
  std::fill(in_limb_.begin(), in_limb_.end(), false);
  if (!add_bone(seed)) return false;
  for (const bool troubled : {true, false}) {
    bool grew = true;
    while (grew) {
      grew = false;
      unconstrained_.assign(in_limb_.begin(), in_limb_.end());  // the limb so far
      for (std::size_t b = 0; b < bones.size(); ++b) {
        if (bones[b].parent < 0) continue;
        const auto parent = static_cast<std::size_t>(bones[b].parent);
        if (in_limb_[b] == in_limb_[parent]) continue;
        const std::size_t next = in_limb_[b] ? parent : b;
        const bool is_from_current = unconstrained_[in_limb_[b] ? b : parent] != 0;
        const bool unread = has_no_trusted_label(in_limb_[b] ? b : parent) && has_no_trusted_label(next);
        const bool is_solved = cooldown_[next] == kCooldownSets;  // in this set, with another limb
        if (!is_from_current || (troubled && (is_solved || (unexplained_[next] == 0 && !unread)))) continue;
        grew = add_bone(next) || grew;
      }
      if (!troubled) break;
    }
  }
  add_candidates(tracks);
  allow_candidates(tracks);
  return true;
}

void SubjectLabeller::add_candidates(const LabelledTracks& tracks) {
  const auto add = [&](int track) {
    return limb_.add_candidate(
        {tracks[track].id, tracks[track].position.v, sigma_of(track, tracks), is_clutter_candidate(track, tracks)});
  };
  for (std::size_t n = 0; n < limb_.label_count(); ++n) {
    const std::size_t m = limb_.marker(n);
    if (accepted_[m] && add(memories_[m].index) && memories_[m].confidence >= kEstablishedConfidence)
      limb_.set_current(n, static_cast<int>(limb_.candidate_count()) - 1);
  }
  nearby_tracks_.clear();
  for (const int track : unassigned_tracks_) {
    const Eigen::Vector3d& at = tracks[track].position.v;
    double nearest_m2 = kLimbReach_m * kLimbReach_m;
    for (std::size_t n = 0; n < limb_.label_count(); ++n)
      nearest_m2 = std::min(nearest_m2, (body_.predicted_position(limb_.marker(n)) - at).squaredNorm());
    if (nearest_m2 < kLimbReach_m * kLimbReach_m) nearby_tracks_.emplace_back(nearest_m2, track);
  }
  std::sort(nearby_tracks_.begin(), nearby_tracks_.end());
  for (const auto& [far, track] : nearby_tracks_) (void)add(track);
}

// What the ties to the names that are not read anew say against a place.
double SubjectLabeller::distance_cost(std::size_t marker, const Eigen::Vector3d& at,
                                      const LabelledTracks& tracks) const {
  double sum = 0.0;
  for (const identify::InterMarkerDistance& constraint : constraints_.of(marker)) {
    const auto other = static_cast<std::size_t>(constraint.other);
    if (!accepted_[other] || in_limb_[static_cast<std::size_t>(set_.markers[other].bone)]) continue;
    sum += DistanceConstraintMatcher::cost_of(constraint, (tracks[memories_[other].index].position.v - at).norm());
  }
  const auto bone = static_cast<std::size_t>(set_.markers[marker].bone);
  const int parent = set_.skeleton.bones[bone].parent;
  if (parent < 0 || in_limb_[static_cast<std::size_t>(parent)]) return sum;
  const double length_m = set_.markers[marker].offset_m.norm();
  const identify::InterMarkerDistance to_joint{0, length_m, length_m, true};
  const auto observability = body_.bone_observability(static_cast<std::size_t>(parent));
  if (observability != pose::SkeletonTracker::Observability::Full) return sum;
  return sum + DistanceConstraintMatcher::cost_of(to_joint, (body_.pose().world()[bone].position - at).norm());
}

// Whether a track may be where rays meet by chance. One that bore a name of the limb or was looked for as one is a
// marker, whichever name it has now.
bool SubjectLabeller::is_clutter_candidate(int index, const LabelledTracks& tracks) const {
  if (tracks[index].state != TrackState::Tentative) return false;
  for (std::size_t n = 0; n < limb_.label_count(); ++n) {
    const std::size_t m = limb_.marker(n);
    const bool is_expected = tracks[index].expected_label == Label{id_, static_cast<std::uint32_t>(m)};
    if (is_expected || continuity_of(m, index, tracks) > 0.0) return false;
  }
  return true;
}

void SubjectLabeller::allow_candidates(const LabelledTracks& tracks) {
  for (std::size_t p = 0; p < limb_.candidate_count(); ++p) {
    const LimbHypothesisSolver::CandidateTrack& candidate = limb_.candidate(p);
    const int track = tracks.find(candidate.track);
    if (candidate.is_young && tracks[track].cameras < kLeastCameras) continue;
    for (std::size_t n = 0; n < limb_.label_count(); ++n) {
      const std::size_t m = limb_.marker(n);
      limb_.allow(n, p, distance_cost(m, candidate.at, tracks), continuity_of(m, track, tracks));
    }
  }
}

}  // namespace mocap::label
