#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "lib/retrack/new_take.h"
#include "lib/retrack/retrack.h"
#include "lib/retrack/set_source.h"
#include "lib/retrack/set_tracker.h"
#include "lib/retrack/span.h"
#include "mocap/v1/take.pb.h"
#include "model/blob.h"
#include "settings/daemon_settings.h"
#include "take/take_reader.h"

namespace mocap::retrack {

/// Reads a part of a take once, from its start to its end, and tracks its sets. One thread.
class Tracking {
 public:
  /// `part`: the sets that are tracked. `camera_ids`: the id in the settings of each camera of the take. `into`: null
  /// if there are no snapshots to be written yet. The take, the settings, `tracker` and `into` outlive the object.
  Tracking(const take::TakeReader& take, const settings::DaemonSettings& settings, std::vector<CameraId> camera_ids,
           std::unique_ptr<SetSource> sets, const Span& part, SetTracker& tracker, NewTake* into);

  /// Tracks the sets between the belief and the start of the take, which are not part of it. Before `run`.
  Status run_lead_in(const v1::Belief& belief, Timestamp start);

  /// Fails as the take's cursor, the tracker and NewTake do, and with EndOfStream if `progress` ended the work.
  Status run(const GoOn& progress);

  const RetrackReport& report() const noexcept { return report_; }

 private:
  Status use(const take::TakeRecord& record);
  Status use_image(const take::TakeRecord& record);
  Status use_snapshot(const take::TakeRecord& record);
  std::optional<BlobFrame> read_image(const take::TakeRecord& record);
  bool is_consistent(const BlobFrame& frame, const take::TakeRecord& record) const;
  Status track_sets(Timestamp read_up_to, const GoOn& progress);
  Status track(const TakeSet& set);
  Status learn(const TakeSet& set);
  double share_of(Timestamp at) const;

  const take::TakeReader& take_;
  const settings::DaemonSettings& settings_;
  std::vector<CameraId> camera_ids_;
  std::unique_ptr<SetSource> sets_;
  Span part_;
  SetTracker& tracker_;
  NewTake* into_;
  Timestamp tracked_up_to_ = Timestamp::min();
  bool is_behind_ = false;              // a set after the part came
  Timestamp start_ = Timestamp::min();  // what was exposed before belongs to the lead-in
  RetrackReport report_;
};

}  // namespace mocap::retrack
