#pragma once

#include <cstdint>

#include "mocap/v1/snapshot.pb.h"

namespace mocap::join {

/// Two positions of one joint at the same time are nearer than this, unless one of the poses is wrong.
inline constexpr double kSameJoint_m = 0.030;

/// How far two chunks agree about one set.
struct Agreement {
  bool holds = true;         ///< every subject agrees
  int differing_labels = 0;  ///< measured by one chunk alone, or at two places
};

/// Compares two snapshots of one set. A subject agrees if neither tracks it; or if both do, at least 80 % of the labels
/// that both measured, and at least 4, are less than 10 mm apart (offline/same_subject), and all joints less than
/// kSameJoint_m.
Agreement agreement_of(const v1::Snapshot& earlier, const v1::Snapshot& later);

/// The entry of a subject in a snapshot; null: there is none.
const v1::SubjectState* subject_in(const v1::Snapshot& snapshot, std::uint32_t subject);

}  // namespace mocap::join
