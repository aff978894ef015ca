#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "lib/retrack/set_source.h"
#include "synchronise/frame_aligner.h"

namespace mocap::retrack {

/// The sets that the daemon's aligner forms of all images of a take, as if no image had been late and no set passed
/// over. Snapshots are dropped.
class AlignedSets : public SetSource {
 public:
  AlignedSets(const synchronise::AlignSettings& settings, std::uint32_t camera_count);

  void add(const BlobFrame& frame) override { frames_.push_back(frame); }
  void add(RecordedSnapshot /*snapshot*/) override {}
  std::optional<TakeSet> next(Timestamp read_up_to) override;

 private:
  std::optional<FrameSet> next_frames(Timestamp read_up_to);

  Duration window_;
  synchronise::FrameAligner aligner_;
  std::deque<BlobFrame> frames_;    // by exposure, not yet in the aligner
  std::optional<Timestamp> first_;  // exposure of the earliest frame in the aligner
};

}  // namespace mocap::retrack
