// The part of SubjectLabeller that chooses the limb to be read anew, and the places where its markers may be.

#include <algorithm>

#include "stages/label_subject.h"

namespace mocap::stages {
namespace {

// A track farther from where a marker is thought to be is not that marker, unless its limb was misread or nobody sees
// any of its bone: then it may be anywhere that the limb reaches.
constexpr double kNear_m = 0.3;
constexpr double kLimbReach_m = 0.6;

}  // namespace

// The bone with most names missing that strays near it could be; -1: none.
int SubjectLabeller::most_troubled_bone(const NamedTracks& tracks) {
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
  int most = -1;
  for (std::size_t b = 0; b < trouble_.size(); ++b) {
    if (trouble_[b] == 0) misread_[b] = 0;
    if (trouble_[b] == 0 || rest_[b] > 0) continue;
    if (most < 0 || trouble_[b] > trouble_[static_cast<std::size_t>(most)]) most = static_cast<int>(b);
  }
  return most;
}

bool SubjectLabeller::add_bone(std::size_t bone) {
  if (in_limb_[bone]) return true;
  std::size_t count = 0;
  for (const MarkerOnBone& marker : set_.markers) count += marker.bone == static_cast<int>(bone) ? 1 : 0;
  if (reader_.names() + count > TieReader::kMostNames) return false;
  in_limb_[bone] = true;
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (set_.markers[m].bone == static_cast<int>(bone)) (void)reader_.add_name(m);
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
  reader_.clear();
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
  place_track_.clear();
  const auto add = [&](int track) {
    if (reader_.add_place(tracks[track].position.v)) place_track_.push_back(track);
  };
  for (std::size_t n = 0; n < reader_.names(); ++n) {
    const std::size_t m = reader_.marker(n);
    if (believed_[m]) add(names_[m].index);
  }
  near_.clear();
  for (const int track : strays_) {
    const Eigen::Vector3d& at = tracks[track].position.v;
    double nearest_m2 = kLimbReach_m * kLimbReach_m;
    for (std::size_t n = 0; n < reader_.names(); ++n)
      nearest_m2 = std::min(nearest_m2, (body_.told(reader_.marker(n)) - at).squaredNorm());
    if (nearest_m2 < kLimbReach_m * kLimbReach_m) near_.emplace_back(nearest_m2, track);
  }
  std::sort(near_.begin(), near_.end());
  for (const auto& [far, track] : near_) add(track);
}

}  // namespace mocap::stages
