#pragma once

#include <cstdint>
#include <optional>

#include "mocap/v1/description.pb.h"
#include "mocap/v1/health.pb.h"
#include "mocap/v1/preview.pb.h"
#include "mocap/v1/sightings.pb.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/description.h"
#include "model/health.h"
#include "model/preview.h"
#include "model/snapshot.h"

namespace mocap::wire {

/// Name of the protocol in each description.
inline constexpr const char* kProtocol = "mocap.v1";

/// Increases when fields are added to the schema.
inline constexpr std::uint32_t kProtocolRevision = 2;

/// Selects the parts of a snapshot that are encoded; the others are absent from the message.
struct Parts {
  bool views = true;
  bool markers = true;
  bool bones = true;
  bool local_positions = true;  ///< of the bones, relative to their parents
  bool velocities = true;       ///< velocities and angular velocities of the bones
  bool unlabelled = true;
  std::optional<SubjectId> subject = std::nullopt;  ///< if set, only this subject is encoded
};

/// Encodes a snapshot into a message. A reused message keeps its memory, so no call allocates after the largest
/// snapshot.
///
/// Positions and rotations are rounded to single precision, confidences to whole percents, residuals to thousandths of
/// a pixel; covariances are omitted. The sender's fields `sequence`, `utc_minus_host_ns`, `synchronisation` and
/// `description` are cleared. The numbers of a marker or bone in state Lost are zero, its rotations the identity.
void encode(const Snapshot& from, v1::Snapshot& into, const Parts& parts = {});

/// Returns whether every bone is at its rest offset from its parent and the local position of each root equals its
/// world position. Then a feed may omit local positions. False if the description has another version than the
/// snapshot.
bool stands_at_rest_offsets(const Snapshot& snapshot, const Description& description);
/// The same for one subject, whose skeleton is that of the snapshot's description.
bool stands_at_rest_offsets(const SubjectPose& pose, const Skeleton& skeleton);

/// Encodes a description together with the conventions of the feed (units, axes, clock). Allocates.
v1::Description encode(const Description& from);

/// Encodes the counters of the daemon. Latency stages without samples are omitted. A reused message keeps its memory.
void encode(const Health& from, v1::Health& into);

/// Encodes which cameras saw the markers of a snapshot, and the covariances of the markers, without its sequence
/// number. Labelled markers that are lost are omitted, as are those of subjects with an index above kMaxSubjects. A
/// reused message keeps its memory.
void encode(const Snapshot& from, v1::Sightings& into);

/// Encodes a preview without its sequence number. A reused message keeps its memory.
void encode(const Preview& from, v1::Preview& into);

}  // namespace mocap::wire
