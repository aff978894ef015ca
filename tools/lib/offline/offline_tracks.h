#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "base/result.h"
#include "fusion/fusion.h"
#include "lib/offline/mirror.h"
#include "lib/offline/record_spool.h"
#include "lib/offline/two_passes.h"
#include "model/snapshot.h"
#include "settings/daemon_settings.h"

namespace mocap::offline {

/// Tracks sets forwards as the daemon does, and backwards with the bodies that were fitted then. So a subject has its
/// labels from the start on, and gaps are filled from both sides.
///
/// Sets and snapshots are kept in temporary files. One thread. Reads no clock.
class OfflineTracks {
 public:
  /// The settings are copied. Temporary files are in `folder`. Fails with Io.
  static Result<std::unique_ptr<OfflineTracks>> create(const settings::DaemonSettings& settings,
                                                       const std::filesystem::path& folder);

  /// A set; sets come in the order of their exposure. Fails with Io.
  Status add(const FrameSet& set);

  /// The backward pass, after the last set. `progress`: share that is done, 0 to 1, once in 100 sets; if it returns
  /// false, the pass ends and fails with EndOfStream. Fails with Io.
  Status finish(const std::function<bool(double)>& progress);

  std::size_t size() const noexcept { return sets_.size(); }
  /// After `finish`, of the set with that index: decoded, so that covariances are absent. Fails with Io.
  Result<Snapshot> snapshot(std::size_t index) const;
  /// With the fitted bodies, to which all snapshots refer.
  const settings::DaemonSettings& settings() const noexcept { return passes_.settings(); }

 private:
  OfflineTracks(RecordSpool sets, TwoPasses passes, RecordSpool joined);
  Result<OwnedSet> set(std::size_t index) const;

  TwoPasses passes_;
  std::unique_ptr<fusion::Fusion> fusion_;  // of the forward pass
  RecordSpool sets_, joined_;               // joined_: from the last set to the first
  Timestamp first_at_, last_at_;
};

}  // namespace mocap::offline
