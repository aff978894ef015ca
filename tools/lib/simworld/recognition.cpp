#include "lib/simworld/recognition.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace mocap::simworld {
namespace {

// Fewest measured labels of a subject from which the subject is matched to an actor.
constexpr std::size_t kEnoughNames = 5;

}  // namespace

Recognition::Recognition(const std::vector<Performer>& performers)
    : may_be_(performers.size()), actor_of_(performers.size(), kNobody) {
  for (std::uint32_t a = 0; a < performers.size(); ++a) {
    for (std::uint32_t b = 0; b < performers.size(); ++b) {
      const Subject &one = performers[a].subject, &other = performers[b].subject;
      const bool alike = !one.fitted && !other.fitted && one.marker_set.name == other.marker_set.name;
      if (a == b || alike) may_be_[a].push_back(b);
    }
  }
}

void Recognition::recognise(std::uint32_t subject, const scoring::EvalFrame& truth,
                            const scoring::EvalFrame& reported) {
  double nearest_m = std::numeric_limits<double>::max();
  std::uint32_t found = kNobody;
  for (const std::uint32_t actor : may_be_[subject]) {
    if (std::ranges::find(actor_of_, actor) != actor_of_.end()) continue;
    double sum_m = 0.0;
    std::size_t names = 0;
    for (const scoring::NamedMarker& name : reported.markers) {
      if (name.subject != subject || name.state != LabelState::Measured) continue;
      for (const scoring::NamedMarker& own : truth.markers) {
        if (own.subject != actor || own.marker != name.marker) continue;
        sum_m += (own.position_m - name.position_m).norm();
        ++names;
      }
    }
    if (names < kEnoughNames || sum_m / static_cast<double>(names) >= nearest_m) continue;
    nearest_m = sum_m / static_cast<double>(names);
    found = actor;
  }
  actor_of_[subject] = found;
}

void Recognition::apply(const scoring::EvalFrame& truth, scoring::EvalFrame& reported) {
  for (std::uint32_t s = 0; s < actor_of_.size(); ++s) {
    if (actor_of_[s] != kNobody) continue;
    if (may_be_[s].size() == 1) {
      actor_of_[s] = s;
    } else {
      recognise(s, truth, reported);
    }
  }
  const auto is_unknown = [&](const auto& thing) { return actor_of_[thing.subject] == kNobody; };
  std::erase_if(reported.markers, is_unknown);
  std::erase_if(reported.bones, is_unknown);
  std::erase_if(reported.subjects, is_unknown);
  for (scoring::NamedMarker& marker : reported.markers) marker.subject = actor_of_[marker.subject];
  for (scoring::PosedBone& bone : reported.bones) bone.subject = actor_of_[bone.subject];
  for (scoring::SubjectSaid& subject : reported.subjects) subject.subject = actor_of_[subject.subject];
  std::ranges::sort(reported.markers, {}, [](const scoring::NamedMarker& m) { return std::pair(m.subject, m.marker); });
  std::ranges::sort(reported.bones, {}, [](const scoring::PosedBone& b) { return std::pair(b.subject, b.bone); });
}

}  // namespace mocap::simworld
