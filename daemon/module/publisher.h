#pragma once

#include "base/result.h"
#include "model/description.h"
#include "model/health.h"
#include "model/preview.h"
#include "model/snapshot.h"

namespace mocap {

/// Sends snapshots to subscribers and never waits for one of them.
///
/// The publish thread owns a Publisher and makes all calls.
class Publisher {
 public:
  virtual ~Publisher() = default;

  /// Sends a new description to all subscribers. A subscriber that connects later receives it first.
  virtual Status describe(const Description& description) = 0;

  /// Sends one snapshot. Sets its `sent_at` if the earlier instants are set. Does not allocate in the steady state.
  virtual Status publish(Snapshot& snapshot) = 0;

  /// Sends the state of the service and serves pending requests of subscribers. Called about once a second.
  virtual Status report(const Health& health) = 0;

  /// Accepts new subscribers and reads their requests. The calls above do this as well; call serve() about twenty times
  /// a second if they are less frequent.
  virtual void serve() {}

  /// Whether somebody subscribes to the previews of this camera of the description.
  virtual bool wants_preview(CameraId /*camera*/) const { return false; }
  /// Sends a preview, if somebody wants it.
  virtual Status send_preview(const Preview& /*preview*/) { return {}; }

  /// The state of the connections to subscribers.
  virtual FeedHealth feed() const { return {}; }
};

}  // namespace mocap
