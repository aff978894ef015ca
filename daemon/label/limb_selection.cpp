// The part of SubjectLabeller that chooses the limb to be read anew, and the places where its markers may be.

#include <algorithm>

#include "label/subject_labeller.h"

namespace mocap::label {
namespace {

// A track farther from where a marker is thought to be is not that marker, unless its limb was misread or nobody sees
// any of its bone: then it may be anywhere that the limb reaches.
constexpr double kNear_m = 0.3;
constexpr double kLimbReach_m = 0.6;
// A name that was given in the last ten sets or so must still be the clear reading when its limb is read anew.
constexpr float kHeld = 0.85F;
// Young tracks of fewer cameras may be where rays meet by chance.
constexpr std::uint32_t kLeastCameras = 3;

}  // namespace

// Counts, by bone, the names that are missing while strays stand near.
void SubjectLabeller::count_trouble(NamedTracks& tracks) {
  for (std::size_t i = 0; i < tracks.sure.size(); ++i) tracks.sure[i] = tracks.named[i];
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (names_[m].index >= 0) tracks.sure[static_cast<std::size_t>(names_[m].index)] = believed_[m];
  }
  strays_.clear();
  for (std::size_t i = 0; i < tracks.named.size(); ++i) {
    if (stray(i, tracks)) strays_.push_back(static_cast<int>(i));
  }
  std::fill(trouble_.begin(), trouble_.end(), 0);
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (believed_[m]) continue;
    const auto bone = static_cast<std::size_t>(set_.markers[m].bone);
    const double near_m = misread_[bone] != 0 || blind(bone) ? kLimbReach_m : kNear_m;
    const Eigen::Vector3d at = body_.told(m);
    const bool near = std::any_of(strays_.begin(), strays_.end(), [&](int track) {
      return (tracks[track].position.v - at).squaredNorm() < near_m * near_m;
    });
    if (near) ++trouble_[bone];
  }
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (contested(m)) ++trouble_[static_cast<std::size_t>(set_.markers[m].bone)];
  }
  for (std::size_t b = 0; b < trouble_.size(); ++b) {
    if (trouble_[b] == 0) misread_[b] = 0;
  }
}

// -1: none that is not at rest.
int SubjectLabeller::most_troubled_bone() const {
  int most = -1;
  for (std::size_t b = 0; b < trouble_.size(); ++b) {
    if (trouble_[b] == 0 || rest_[b] > 0) continue;
    if (most < 0 || trouble_[b] > trouble_[static_cast<std::size_t>(most)]) most = static_cast<int>(b);
  }
  return most;
}

bool SubjectLabeller::add_bone(std::size_t bone) {
  if (in_limb_[bone]) return true;
  std::size_t count = 0;
  for (const MarkerOnBone& marker : set_.markers) count += marker.bone == static_cast<int>(bone) ? 1 : 0;
  if (limb_.names() + count > TieReader::kMostNames) return false;
  in_limb_[bone] = true;
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (set_.markers[m].bone == static_cast<int>(bone)) (void)limb_.add_name(m);
  }
  return true;
}

// Whether a bone has names and none of them is believed.
bool SubjectLabeller::blind(std::size_t bone) const {
  bool any = false;
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (set_.markers[m].bone != static_cast<int>(bone)) continue;
    if (believed_[m]) return false;
    any = true;
  }
  return any;
}

// The bone, the bones in trouble that hang together with it, and those that hang on to these. Nobody knows where a bone
// is whose names are missing, and that hangs on one whose names are missing, too.
bool SubjectLabeller::gather_limb(std::size_t seed, const NamedTracks& tracks) {
  const auto& bones = set_.skeleton.bones;
  limb_.clear();
  std::fill(in_limb_.begin(), in_limb_.end(), false);
  if (!add_bone(seed)) return false;
  for (const bool troubled : {true, false}) {
    bool grew = true;
    while (grew) {
      grew = false;
      loose_.assign(in_limb_.begin(), in_limb_.end());  // the limb so far
      for (std::size_t b = 0; b < bones.size(); ++b) {
        if (bones[b].parent < 0) continue;
        const auto parent = static_cast<std::size_t>(bones[b].parent);
        if (in_limb_[b] == in_limb_[parent]) continue;
        const std::size_t next = in_limb_[b] ? parent : b;
        const bool from_now = loose_[in_limb_[b] ? b : parent] != 0;
        const bool unread = blind(in_limb_[b] ? b : parent) && blind(next);
        const bool read = rest_[next] == kPatience;  // in this set, with another limb
        if (!from_now || (troubled && (read || (trouble_[next] == 0 && !unread)))) continue;
        grew = add_bone(next) || grew;
      }
      if (!troubled) break;
    }
  }
  add_places(tracks);
  allow_places(tracks);
  return true;
}

void SubjectLabeller::add_places(const NamedTracks& tracks) {
  const auto add = [&](int track) {
    return limb_.add_place(
        {tracks[track].id, tracks[track].position.v, sigma_of(track, tracks), too_young(track, tracks)});
  };
  for (std::size_t n = 0; n < limb_.names(); ++n) {
    const std::size_t m = limb_.marker(n);
    if (believed_[m] && add(names_[m].index) && names_[m].confidence >= kHeld)
      limb_.hold(n, static_cast<int>(limb_.places()) - 1);
  }
  near_.clear();
  for (const int track : strays_) {
    const Eigen::Vector3d& at = tracks[track].position.v;
    double nearest_m2 = kLimbReach_m * kLimbReach_m;
    for (std::size_t n = 0; n < limb_.names(); ++n)
      nearest_m2 = std::min(nearest_m2, (body_.told(limb_.marker(n)) - at).squaredNorm());
    if (nearest_m2 < kLimbReach_m * kLimbReach_m) near_.emplace_back(nearest_m2, track);
  }
  std::sort(near_.begin(), near_.end());
  for (const auto& [far, track] : near_) (void)add(track);
}

// What the ties to the names that are not read anew say against a place.
double SubjectLabeller::anchored(std::size_t marker, const Eigen::Vector3d& at, const NamedTracks& tracks) const {
  double sum = 0.0;
  for (const identify::Tie& tie : ties_.of(marker)) {
    const auto other = static_cast<std::size_t>(tie.other);
    if (!believed_[other] || in_limb_[static_cast<std::size_t>(set_.markers[other].bone)]) continue;
    sum += TieReader::cost_of(tie, (tracks[names_[other].index].position.v - at).norm());
  }
  const auto bone = static_cast<std::size_t>(set_.markers[marker].bone);
  const int parent = set_.skeleton.bones[bone].parent;
  if (parent < 0 || in_limb_[static_cast<std::size_t>(parent)]) return sum;
  const double length_m = set_.markers[marker].offset_m.norm();
  const identify::Tie to_joint{0, length_m, length_m, true};
  const auto told = body_.told_by_markers(static_cast<std::size_t>(parent));
  if (told != pose::BodyFollower::Told::Direct) return sum;
  return sum + TieReader::cost_of(to_joint, (body_.pose().world()[bone].position - at).norm());
}

// Whether a track may be where rays meet by chance. One that bore a name of the limb or was looked for as one is a
// marker, whichever name it has now.
bool SubjectLabeller::too_young(int index, const NamedTracks& tracks) const {
  if (tracks[index].state != TrackState::Tentative) return false;
  for (std::size_t n = 0; n < limb_.names(); ++n) {
    const std::size_t m = limb_.marker(n);
    const bool called = tracks[index].expected_label == Label{id_, static_cast<std::uint32_t>(m)};
    if (called || hint_of(m, index, tracks) > 0.0) return false;
  }
  return true;
}

void SubjectLabeller::allow_places(const NamedTracks& tracks) {
  for (std::size_t p = 0; p < limb_.places(); ++p) {
    const LimbReader::Place& place = limb_.place(p);
    const int track = tracks.find(place.track);
    if (place.young && tracks[track].cameras < kLeastCameras) continue;
    for (std::size_t n = 0; n < limb_.names(); ++n) {
      const std::size_t m = limb_.marker(n);
      limb_.allow(n, p, anchored(m, place.at, tracks), hint_of(m, track, tracks));
    }
  }
}

}  // namespace mocap::label
