#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "chaos/episode.h"
#include "chaos/invariants.h"
#include "runtime/publish_worker.h"

namespace mocap::chaos {

/// The feed with one subscriber behind a link that loses and cuts messages. The publish thread's own code
/// (PublishWorker) sends; it runs in the caller's thread.
class VirtualFeed {
 public:
  /// The episode outlives the feed.
  VirtualFeed(const Episode& episode, Description description);
  ~VirtualFeed();

  /// Hands a snapshot with its fit to the publish queue. False: the queue is full, and the snapshot is dropped.
  bool push(const Snapshot& snapshot, const std::optional<SubjectFit>& fit);
  /// Sends what waits.
  void send(double t_s);
  /// Continues with another configuration.
  void change(Description description);

  /// The first fault that the subscriber, or the count of the snapshots, has shown.
  const Finding& finding() const { return finding_; }
  /// A hash of all bytes sent.
  std::uint64_t hash() const;
  const Description& sent_description() const;
  /// Snapshots that the subscriber has read.
  std::uint64_t read_snapshots() const;

 private:
  class Link;
  runtime::PublishWorker::Links links();
  void count();

  runtime::SnapshotChannel channel_;
  runtime::FusionCounters fusion_;
  runtime::PublishCounters counters_;
  std::unique_ptr<Link> owned_link_;
  Link* link_;
  runtime::PublishWorker worker_;
  std::uint64_t pushed_ = 0, refused_ = 0;
  Finding finding_;
};

}  // namespace mocap::chaos
