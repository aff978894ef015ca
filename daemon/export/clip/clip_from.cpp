#include "export/clip/clip_from.h"

namespace mocap::exports {
namespace {

constexpr std::size_t kSnapshotsPerReport = 500;

}  // namespace

Status read_into(ClipBuilder& builder, take::SnapshotReader& recording, const std::function<void(double)>& progress) {
  std::uint32_t version = 0;
  for (std::size_t count = 0;; ++count) {
    const Result<const take::RecordedSnapshot*> next = recording.next();
    if (!next) return next.error();
    if (*next == nullptr) break;
    const take::RecordedSnapshot& recorded = **next;
    if (count == 0 || recording.description().version != version) {
      if (const Status learnt = builder.learn(recording.description()); !learnt) return learnt;
      version = recording.description().version;
    }
    const Status added = builder.add(recorded.snapshot, recorded.utc_minus_host_ns);
    if (!added) return added;
    if (count % kSnapshotsPerReport == 0) progress(recording.progress());
  }
  for (const take::RecordedMark& mark : recording.marks()) builder.mark(mark.at, mark.text);
  return {};
}

}  // namespace mocap::exports
