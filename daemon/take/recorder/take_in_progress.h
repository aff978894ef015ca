#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/clock/timecode.h"
#include "model/description.h"
#include "model/take/take_order.h"
#include "take/recorder/edge_images.h"
#include "take/recorder/lead_in.h"
#include "take/recorder/take_buffer.h"
#include "take/recorder/take_intake.h"
#include "take/take_quality.h"
#include "take/take_writer.h"

namespace mocap::take {

/// A take that is being recorded: its file, its bounds and its quality so far. One thread owns it.
class TakeInProgress {
 public:
  /// `info` and `description`: as the file was begun with. `snapshots`: whether the file gets them.
  TakeInProgress(std::unique_ptr<TakeWriter> writer, TakeInfo info, const Description& description, bool snapshots);

  /// Writes a message of the memory if it is within the bounds, or an image of a set that is. Fails as
  /// TakeWriter::append does.
  Status write(const BufferedMessage& message);

  /// Whether images after `to` may belong to a set of the take whose snapshot did not come yet.
  bool awaits_set() const noexcept { return to && !drained && !edges_.empty(); }

  /// Completes info and file. `ended_early`: the reason; empty: as ordered. Fails as TakeWriter::finish does.
  Status finish(Timestamp now, const QualityReport& report, const std::string& ended_early);

  /// The result of the take, for log and operator. `fault`: why it ended early; empty: it did not.
  std::string words(const QualityReport& report, const std::string& fault) const;

  std::unique_ptr<TakeWriter> writer;
  TakeInfo info;
  TakeMeter meter;
  Timestamp from;               ///< earlier messages are left out
  std::optional<Timestamp> to;  ///< later messages are left out
  bool drained = false;         ///< a snapshot after `to` came
  Timestamp checked_at;         ///< free space and folder
  TakeIntake::Dropped dropped_before;
  std::optional<TakeOrder> stopped_by;  ///< to be answered when the file is complete
  std::string shot;                     ///< its name in the shot list; empty: none

 private:
  Status append(const BufferedMessage& message);
  Status write_image(const BufferedMessage& image);
  Status append_image(std::uint32_t camera, Timestamp at, std::string_view bytes);
  Status append_snapshot(const BufferedMessage& message);

  bool snapshots_;
  std::vector<std::string> blob_topics_;                    // by camera
  std::optional<Timecode> first_timecode_, last_timecode_;  // of the snapshots
  EdgeImages edges_;
  LeadIn lead_in_;
  v1::Snapshot read_;
  std::string written_;
};

}  // namespace mocap::take
