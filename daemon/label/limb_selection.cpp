// The part of SubjectLabeller that selects the limb to be labelled as a whole, and the candidate tracks of its markers.

#include <algorithm>
#include <cmath>
#include <limits>

#include "kinematics/kinematic_tree.h"
#include "label/subject_labeller.h"

namespace mocap::label {
namespace {

// Distance from its prediction within which a track makes a missing label unexplained. If no label of the bone is
// accepted, or labels of the bone were rejected, the distance is the reach of a limb: half a second is enough for a
// hand to be half a metre away (decision 0009), and for a shin to point the other way (`reach_m`). Chosen by hand; not
// yet measured.
constexpr double kCandidateRadius_m = 0.3;
constexpr double kLimbReach_m = 0.6;

}  // namespace

// How far a marker can be from its prediction if the rotation that it observes is unknown.
double SubjectLabeller::reach_m(std::size_t marker) const {
  const MarkerOnBone& on = set_.markers[marker];
  const Bone& bone = set_.skeleton.bones[static_cast<std::size_t>(on.bone)];
  const double lever_m = kinematics::sits_in_joint(on) ? bone.rest_offset_m.norm() : on.offset_m.norm();
  return std::max(kLimbReach_m, 2.0 * lever_m);
}

// Counts, by bone, the labels that are not accepted while an unassigned track is near, and the contested labels.
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
    const double radius_m = unreliable_[bone] != 0 || has_no_trusted_label(bone) ? reach_m(m) : kCandidateRadius_m;
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

// The bone with most unexplained labels, except bones in cooldown; -1 if there is none.
int SubjectLabeller::worst_bone() const {
  int most = -1;
  for (std::size_t b = 0; b < unexplained_.size(); ++b) {
    if (unexplained_[b] == 0 || cooldown_[b] > 0) continue;
    if (most < 0 || unexplained_[b] > unexplained_[static_cast<std::size_t>(most)]) most = static_cast<int>(b);
  }
  return most;
}

// Adds the labels of a bone to the limb. Returns false if the limb cannot hold all of them.
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

// Whether a bone has markers but no accepted label.
bool SubjectLabeller::has_no_trusted_label(std::size_t bone) const {
  bool any = false;
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    if (set_.markers[m].bone != static_cast<int>(bone)) continue;
    if (accepted_[m]) return false;
    any = true;
  }
  return any;
}

// Collects the limb around the bone `seed`: first all connected bones with unexplained labels, where two adjacent bones
// without any accepted label also count (their common joint is unknown), then all bones adjacent to these. Bones whose
// limb was labelled in this set are not added in the first round.
bool SubjectLabeller::gather_limb(std::size_t seed, const LabelledTracks& tracks) {
  const auto& bones = set_.skeleton.bones;
  limb_.clear();
  std::fill(in_limb_.begin(), in_limb_.end(), false);
  if (!add_bone(seed)) return false;
  for (const bool only_unexplained : {true, false}) {
    bool grew = true;
    while (grew) {
      grew = false;
      unconstrained_.assign(in_limb_.begin(), in_limb_.end());  // the limb before this round
      for (std::size_t b = 0; b < bones.size(); ++b) {
        if (bones[b].parent < 0) continue;
        const auto parent = static_cast<std::size_t>(bones[b].parent);
        if (in_limb_[b] == in_limb_[parent]) continue;
        const std::size_t next = in_limb_[b] ? parent : b;
        const bool is_from_current = unconstrained_[in_limb_[b] ? b : parent] != 0;
        const bool is_unlabelled = has_no_trusted_label(in_limb_[b] ? b : parent) && has_no_trusted_label(next);
        const bool is_solved = cooldown_[next] == kCooldownSets;  // as part of another limb in this set
        if (!is_from_current || (only_unexplained && (is_solved || (unexplained_[next] == 0 && !is_unlabelled))))
          continue;
        grew = add_bone(next) || grew;
      }
      if (!only_unexplained) break;
    }
  }
  add_candidates(tracks);
  allow_candidates(tracks);
  return true;
}

// Candidates are the tracks of the limb's accepted labels, of which the established ones are the current assignment,
// and then the unassigned tracks in reach, nearest first, as many as the solver takes.
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
    double nearest_m2 = std::numeric_limits<double>::infinity();
    for (std::size_t n = 0; n < limb_.label_count(); ++n) {
      const double off_m2 = (body_.predicted_position(limb_.marker(n)) - at).squaredNorm();
      const double reach = reach_m(limb_.marker(n));
      if (off_m2 < reach * reach) nearest_m2 = std::min(nearest_m2, off_m2);
    }
    if (std::isfinite(nearest_m2)) nearby_tracks_.emplace_back(nearest_m2, track);
  }
  std::sort(nearby_tracks_.begin(), nearby_tracks_.end());
  for (const auto& [far, track] : nearby_tracks_) (void)add(track);
}

// Cost, half chi-square, of the distances from a position to the accepted markers outside the limb, and to the joint of
// the marker's bone if the rotation of the parent bone is fully observed.
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

// Whether a track may be clutter (rays that intersect by chance): it is tentative, was not detected for a label of the
// limb, and has no continuity with one.
bool SubjectLabeller::is_clutter_candidate(int index, const LabelledTracks& tracks) const {
  if (tracks[index].state != TrackState::Tentative) return false;
  for (std::size_t n = 0; n < limb_.label_count(); ++n) {
    const std::size_t m = limb_.marker(n);
    const bool is_expected =
        tracks.predicted_label(static_cast<std::size_t>(index)) == Label{id_, static_cast<std::uint32_t>(m)};
    if (is_expected || continuity_of(m, index, tracks) > 0.0) return false;
  }
  return true;
}

// Allows every candidate for every label of the limb, except tentative tracks of few cameras.
void SubjectLabeller::allow_candidates(const LabelledTracks& tracks) {
  for (std::size_t p = 0; p < limb_.candidate_count(); ++p) {
    const LimbHypothesisSolver::CandidateTrack& candidate = limb_.candidate(p);
    const int track = tracks.find(candidate.track);
    if (candidate.is_young && tracks[track].cameras < kMinTentativeCameras) continue;
    for (std::size_t n = 0; n < limb_.label_count(); ++n) {
      const std::size_t m = limb_.marker(n);
      limb_.allow(n, p, distance_cost(m, candidate.at, tracks), continuity_of(m, track, tracks));
    }
  }
}

}  // namespace mocap::label
