#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "fusion/fusion.h"
#include "lib/offline/offline_tracks.h"
#include "model/description.h"
#include "model/sighting.h"
#include "model/snapshot.h"
#include "settings/daemon_settings.h"

namespace mocap::retrack {

/// Makes the snapshot of each set, in the order of the sets.
class SetTracker {
 public:
  virtual ~SetTracker() = default;

  /// Borrowed until the next call. Null: there is none yet.
  virtual Result<const Snapshot*> step(const FrameSet& set) = 0;
  /// The fit that the last snapshot is the first to use.
  virtual const std::optional<SubjectFit>& fit() const = 0;
};

/// As the daemon does.
class LiveTracker : public SetTracker {
 public:
  explicit LiveTracker(const settings::DaemonSettings& settings);

  /// Takes over a belief. False if it is not one of such settings; the tracker must not be used then.
  bool restore(std::string_view state);
  /// The description with the bodies in force.
  Description describe(Description description) const;

  Result<const Snapshot*> step(const FrameSet& set) override { return &fusion_->step(set); }
  const std::optional<SubjectFit>& fit() const override { return fusion_->fit(); }

 private:
  std::unique_ptr<fusion::Fusion> fusion_;
};

/// Collects the sets of a take. After OfflineTracks::finish, gives the snapshots of the same sets.
class OfflineTracker : public SetTracker {
 public:
  explicit OfflineTracker(offline::OfflineTracks& tracks) : tracks_(tracks) {}

  /// From now on the sets come once more.
  void begin_again() { next_ = 0; }

  Result<const Snapshot*> step(const FrameSet& set) override;
  const std::optional<SubjectFit>& fit() const override { return none_; }

 private:
  offline::OfflineTracks& tracks_;
  std::optional<std::size_t> next_;
  Snapshot snapshot_;
  const std::optional<SubjectFit> none_;
};

}  // namespace mocap::retrack
