#include "lib/retrack/set_tracker.h"

#include <span>
#include <utility>

#include "assemble.h"
#include "base/archive.h"

namespace mocap::retrack {

LiveTracker::LiveTracker(const settings::DaemonSettings& settings) : fusion_(assemble_fusion(settings)) {}

bool LiveTracker::restore(std::string_view state) {
  Archive members = Archive::reader(std::as_bytes(std::span(state)));
  fusion_->archive(members);
  return members.ok() && members.size() == state.size();
}

Description LiveTracker::describe(Description description) const {
  for (const SubjectFit& fit : fusion_->fits()) description = with_fit(std::move(description), fit);
  description.version = fusion_->description_version();
  return description;
}

Result<const Snapshot*> OfflineTracker::step(const FrameSet& set) {
  if (!next_) {
    const Status added = tracks_.add(set);
    return added ? Result<const Snapshot*>(nullptr) : added.error();
  }
  Result<Snapshot> snapshot = tracks_.snapshot((*next_)++);
  if (!snapshot) return snapshot.error();
  snapshot_ = *std::move(snapshot);
  return &snapshot_;
}

}  // namespace mocap::retrack
