#include <algorithm>

#include "kinematics/archive_body.h"
#include "label/subject_labeller.h"

namespace mocap::label {

void SubjectLabeller::LabelMemory::archive(Archive& members) {
  members(track, reject_count, confidence, usual_residual_m, established, last_track, was_discontinuous, is_continuous);
  members(discontinuous, ambiguous_track, marginals, ambiguous_at, seen_at, at, velocity_m_s);
}

// `match_tracks` and `predict` set the members that are missing here, or they are scratch of one set.
void SubjectLabeller::archive(Archive& members) {
  kinematics::archive_offsets(set_, members);
  members(constraints_, body_, phase_, identifications_, at_, determined_at_, enough_at_, plausible_at_, memories_,
          participates_);
  members(usual_residual_m_, limb_, initial_tracks_, cooldown_, in_limb_, unreliable_, fit_);
  if (members.is_reading() && !has_valid_memories()) members.fail();
}

// Whether each track has one label, each marginal one of the markers, and each label fewer rejections than end it.
bool SubjectLabeller::has_valid_memories() const {
  const auto is_marker = [&](const Marginal& marginal) { return marginal.marker < memories_.size(); };
  return std::ranges::all_of(memories_, [&](const LabelMemory& memory) {
    return std::ranges::all_of(memory.marginals, is_marker) && memory.reject_count < kMaxRejectCount &&
           (!memory.track.names_something() || std::ranges::count(memories_, memory.track, &LabelMemory::track) == 1);
  });
}

}  // namespace mocap::label
