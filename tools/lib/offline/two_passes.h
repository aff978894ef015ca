#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "base/result.h"
#include "lib/offline/ages.h"
#include "lib/offline/record_spool.h"
#include "lib/offline/two_way.h"
#include "model/description.h"
#include "model/snapshot.h"
#include "settings/daemon_settings.h"

namespace mocap::offline {

/// The snapshots of a forward pass over a recording, joined with those of a backward pass that knows the bodies which
/// the forward pass fitted. The caller runs both passes.
///
/// Snapshots of the forward pass are kept in a temporary file. One thread. Reads no clock.
class TwoPasses {
 public:
  /// `settings`: of the forward pass, copied. The temporary file is in `folder`. Fails with Io.
  static Result<TwoPasses> create(const settings::DaemonSettings& settings, const std::filesystem::path& folder);

  /// A step of the forward pass; times rise. `fit`: as Fusion::fit after that step. Fails with Io.
  Status add(const Snapshot& snapshot, const std::optional<SubjectFit>& fit);

  /// Ends the forward pass. From then on settings() are those of the backward pass.
  void turn();

  /// With the fitted bodies after turn(); the backward pass does not fit them again.
  const settings::DaemonSettings& settings() const noexcept { return *settings_; }

  /// Joins the next step of the backward pass, from the last to the first. Its time is mirrored (Mirror). The joined
  /// snapshot has the time of the forward pass, and no covariances. Fails with Io. Precondition: turn() was called.
  Result<Snapshot> join(const Snapshot& backward);

 private:
  TwoPasses(const settings::DaemonSettings& settings, RecordSpool forward);
  Status read_forward_pass();

  std::unique_ptr<settings::DaemonSettings> settings_;
  Description fitted_;
  AgeWatch ages_;  // of the pass that runs
  RecordSpool forward_;
  std::size_t left_ = 0;  // steps of the forward pass that were not joined yet
  // Of the step that is joined; not on the stack, because a snapshot has 0.8 MB.
  std::unique_ptr<Pass> forward_pass_ = std::make_unique<Pass>(), backward_pass_ = std::make_unique<Pass>();
  std::optional<TwoWay> both_;
};

}  // namespace mocap::offline
