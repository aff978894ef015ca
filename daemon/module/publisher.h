#pragma once

#include "base/result.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap {

/// Sends to whoever listens; never waits for a listener. The publish thread owns it and makes all calls.
class Publisher {
 public:
  virtual ~Publisher() = default;

  /// From now on this is what a new listener gets first; those who listen already get it now.
  virtual Status describe(const Description& description) = 0;

  /// Sends one snapshot; allocates nothing of its own in the steady state. Stamps `sent_at` if the other instants are
  /// there.
  virtual Status publish(Snapshot& snapshot) = 0;

  /// Sends the state of the service, serves what listeners ask for; about once a second.
  virtual Status report(const Health& health) = 0;

  /// Lets new listeners in and takes in what they ask for. The calls above do so, too; call it some twenty times a
  /// second where they are rarer.
  virtual void serve() {}

  /// Who listens.
  virtual FeedHealth feed() const { return {}; }
};

}  // namespace mocap
