#include "eval/scored_part.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace mocap::eval {

Result<ScoredPart> ScoredPart::make(const std::string& below, const std::vector<simworld::Performer>& performers) {
  ScoredPart part;
  if (below.empty()) return part;
  for (const simworld::Performer& performer : performers) {
    const MarkerSet& marker_set = performer.subject.marker_set;
    const std::vector<Bone>& bones = marker_set.skeleton.bones;
    std::vector<bool> named(bones.size());
    std::istringstream words(below);
    for (std::string name; words >> name;) {
      const auto bone = std::ranges::find(bones, name, &Bone::name);
      if (bone == bones.end()) {
        return Error{ErrorCode::InvalidArgument, fmt::format("score: {} has no bone '{}'", marker_set.name, name)};
      }
      named[static_cast<std::size_t>(bone - bones.begin())] = true;
    }
    Subject& subject = part.subjects_.emplace_back();
    for (const Bone& bone : bones) {  // a parent comes before its children
      const auto parent = static_cast<std::size_t>(std::max(0, bone.parent));
      subject.bones.push_back(bone.parent >= 0 && (named[parent] || subject.bones[parent]));
    }
    for (const MarkerOnBone& marker : marker_set.markers) {
      subject.markers.push_back(subject.bones[static_cast<std::size_t>(marker.bone)]);
    }
  }
  return part;
}

scoring::EvalFrame ScoredPart::of(const scoring::EvalFrame& frame) const {
  scoring::EvalFrame part = frame;
  if (subjects_.empty()) return part;
  std::erase_if(part.markers,
                [&](const scoring::NamedMarker& each) { return !subjects_[each.subject].markers[each.marker]; });
  std::erase_if(part.bones, [&](const scoring::PosedBone& each) { return !subjects_[each.subject].bones[each.bone]; });
  return part;
}

}  // namespace mocap::eval
