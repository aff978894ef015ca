#include "lib/join/agreement.h"

#include <algorithm>
#include <cmath>

#include "lib/offline/same_subject.h"

namespace mocap::join {
namespace {

bool is_measured(const v1::LabelledMarkers& markers, int marker) {
  return marker < markers.states_size() && markers.states(marker) == v1::MARKER_STATE_MEASURED &&
         3 * marker + 2 < markers.positions_m_size();
}

using Positions = google::protobuf::RepeatedField<float>;

double distance_m(const Positions& one_m, const Positions& other_m, int index) {
  const auto difference = [&](int axis) { return double{one_m[3 * index + axis]} - other_m[3 * index + axis]; };
  return std::hypot(difference(0), difference(1), difference(2));
}

// Whether the labels of a subject agree; adds those that differ to `differing`.
bool labels_agree(const v1::LabelledMarkers& one, const v1::LabelledMarkers& other, int& differing) {
  int both = 0, same = 0, alone = 0;
  for (int m = 0; m < std::max(one.states_size(), other.states_size()); ++m) {
    const bool by_one = is_measured(one, m), by_other = is_measured(other, m);
    alone += by_one != by_other ? 1 : 0;
    if (!by_one || !by_other) continue;
    ++both;
    same += distance_m(one.positions_m(), other.positions_m(), m) < offline::kSameMarker_m ? 1 : 0;
  }
  differing += alone + both - same;
  return both >= offline::kFewestLabels && same >= offline::kAgreeingShare * both;
}

// Bones that one of them has lost have no joint.
bool joints_agree(const v1::BonePoses& one, const v1::BonePoses& other) {
  const int count = std::min(
      {one.states_size(), other.states_size(), one.world_positions_m_size() / 3, other.world_positions_m_size() / 3});
  for (int b = 0; b < count; ++b) {
    if (one.states(b) == v1::BONE_STATE_LOST || other.states(b) == v1::BONE_STATE_LOST) continue;
    if (distance_m(one.world_positions_m(), other.world_positions_m(), b) >= kSameJoint_m) return false;
  }
  return true;
}

bool subject_agrees(const v1::SubjectState& own, const v1::SubjectState* other, int& differing) {
  const bool tracked = own.phase() == v1::SUBJECT_PHASE_TRACKING;
  const bool tracked_by_other = other != nullptr && other->phase() == v1::SUBJECT_PHASE_TRACKING;
  if (!tracked || !tracked_by_other) return tracked == tracked_by_other;
  return labels_agree(own.markers(), other->markers(), differing) && joints_agree(own.bones(), other->bones());
}

}  // namespace

const v1::SubjectState* subject_in(const v1::Snapshot& snapshot, std::uint32_t subject) {
  const auto found = std::ranges::find(snapshot.subjects(), subject, &v1::SubjectState::subject);
  return found == snapshot.subjects().end() ? nullptr : &*found;
}

Agreement agreement_of(const v1::Snapshot& earlier, const v1::Snapshot& later) {
  Agreement agreement;
  for (const v1::SubjectState& own : earlier.subjects()) {
    const bool agrees = subject_agrees(own, subject_in(later, own.subject()), agreement.differing_labels);
    agreement.holds = agreement.holds && agrees;
  }
  return agreement;
}

}  // namespace mocap::join
