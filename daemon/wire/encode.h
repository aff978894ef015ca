#pragma once

#include <optional>

#include "mocap/v1/description.pb.h"
#include "mocap/v1/health.pb.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap::wire {

/// What a feed of this schema calls itself.
inline constexpr const char* kProtocol = "mocap.v1";

/// Counts up when fields are added to the schema.
inline constexpr std::uint32_t kProtocolRevision = 1;

/// What of a snapshot is written; the rest is absent.
struct Parts {
  bool views = true;
  bool markers = true;
  bool bones = true;
  bool local_positions = true;  ///< of the bones
  bool velocities = true;       ///< of the bones, and spins
  bool unlabelled = true;
  std::optional<SubjectId> subject = std::nullopt;  ///< this one alone
};

/// Writes a snapshot into a message. The same message given again and again keeps its memory: once it has held the
/// largest snapshot, nothing is allocated. Positions and rotations become single precision, confidences whole percents,
/// residuals thousandths of a pixel; covariances stay behind. What belongs to the sender is cleared: `sequence`,
/// `utc_minus_host_ns`, `synchronisation`. A marker or bone that is Lost has zeros (and the identity) for the numbers
/// that mean nothing.
void encode(const Snapshot& from, v1::Snapshot& into, const Parts& parts = {});

/// Whether every bone stands at its rest offset from its parent, and each root where it is in the world: then a feed
/// may leave local positions out. False where the description is of another version.
bool stands_at_rest_offsets(const Snapshot& snapshot, const Description& description);

/// With the conventions of the whole feed. Rare; allocates.
v1::Description encode(const Description& from);

/// Stages that nothing passed are left out. The same message given again and again keeps its memory.
void encode(const Health& from, v1::Health& into);

}  // namespace mocap::wire
