#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/time.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/blob.h"
#include "model/sighting.h"

namespace mocap::retrack {

/// A snapshot of a take, and its bytes.
struct RecordedSnapshot {
  v1::Snapshot message;
  std::string bytes;
};

/// A frame set of a take.
struct TakeSet {
  FrameSet frames;                           ///< its views are borrowed until the next call of the source
  std::optional<RecordedSnapshot> recorded;  ///< what the daemon made of this set
  std::uint32_t missing_views = 0;           ///< that the daemon had, and the take does not
};

/// Forms the frame sets of a take, whose images and snapshots come in the order of their times.
class SetSource {
 public:
  virtual ~SetSource() = default;

  virtual void add(const BlobFrame& frame) = 0;
  virtual void add(RecordedSnapshot snapshot) = 0;

  /// The oldest set of which everything was added: all that was exposed before `read_up_to`. Call until it returns
  /// nothing.
  virtual std::optional<TakeSet> next(Timestamp read_up_to) = 0;
};

}  // namespace mocap::retrack
