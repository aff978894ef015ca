#include "lib/retrack/tracking.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

namespace mocap::retrack {
namespace {

using take::TakeRecord;
using take::TakeTopic;

constexpr std::uint64_t kSetsPerProgress = 100;
// An image takes less time to arrive and to be processed; a longer one is damage.
constexpr Duration kLongestDelay = std::chrono::hours(1);
// The images of a set are exposed within less time than this.
constexpr Duration kLongestSet = std::chrono::seconds(1);

// Whether a camera of this image size can have seen the blobs. Other numbers are damage, which the tracking must not
// calculate with. The centre of a disc that the border of the image cuts off may be outside of it.
bool has_possible_blobs(const BlobFrame& frame, const CameraModel& camera) {
  const double pixels = static_cast<double>(camera.width_px) * camera.height_px;
  const auto is_near = [](double at_px, int side_px) { return at_px >= -side_px && at_px <= 2.0 * side_px; };
  return std::ranges::all_of(frame.blobs, [&](const Blob& blob) {
    return is_near(blob.centroid.v.x(), camera.width_px) && is_near(blob.centroid.v.y(), camera.height_px) &&
           blob.sigma_px <= camera.width_px && blob.area_px2 >= 0.0 && blob.area_px2 <= pixels;
  });
}

// From the first image on that a set of the part can have.
take::TakeSelection selection_of(const Span& part) {
  take::TakeSelection selection;
  if (part.from != Timestamp::min()) selection.from = part.from - kLongestSet;
  return selection;
}

}  // namespace

Tracking::Tracking(const take::TakeReader& take, const settings::DaemonSettings& settings,
                   std::vector<CameraId> camera_ids, std::unique_ptr<SetSource> sets, const Span& part,
                   SetTracker& tracker, NewTake* into)
    : take_(take),
      settings_(settings),
      camera_ids_(std::move(camera_ids)),
      sets_(std::move(sets)),
      part_(part),
      tracker_(tracker),
      into_(into) {}

Status Tracking::run(const GoOn& progress) {
  take::TakeCursor cursor = take_.messages(selection_of(part_));
  for (;;) {
    const Result<std::optional<TakeRecord>> record = cursor.next();
    if (!record && record.error().code != ErrorCode::InvalidArgument) return record.error();
    if (!record) {
      ++report_.damaged;  // the cursor goes on behind the damaged chunk
      continue;
    }
    const bool ended = !*record;
    if (const Status tracked = track_sets(ended ? Timestamp::max() : (*record)->at, progress); !tracked) return tracked;
    if (ended || is_behind_) return {};
    if (const Status used = use(**record); !used) return used;
  }
}

// Tracks the sets between the belief and the start of the take, which are not part of it. Before `run`.
Status Tracking::run_lead_in(const v1::Belief& belief, Timestamp start) {
  start_ = start;
  for (const v1::Snapshot& set : belief.sets()) sets_->add(RecordedSnapshot{set, {}});
  std::vector<const v1::CameraBlobs*> images;
  for (const v1::CameraBlobs& image : belief.images()) images.push_back(&image);
  std::ranges::stable_sort(images, {}, [](const v1::CameraBlobs* image) { return image->exposed_at_ns(); });
  for (const v1::CameraBlobs* image : images) {
    const Timestamp at = from_ns(image->exposed_at_ns());
    if (const Status tracked = track_sets(at, [](const auto&) { return true; }); !tracked) return tracked;
    const std::string bytes = image->SerializeAsString();
    if (const auto frame = read_image({TakeTopic::Blobs, at, bytes})) sets_->add(*frame);
  }
  return {};
}

Status Tracking::use(const TakeRecord& record) {
  switch (record.topic) {
    case TakeTopic::Blobs: return use_image(record);
    case TakeTopic::Snapshot: return use_snapshot(record);
    case TakeTopic::Health: return into_ == nullptr ? Status{} : into_->append(take::kHealthTopic, record);
    case TakeTopic::Event: return into_ == nullptr ? Status{} : into_->append(take::kEventTopic, record);
    case TakeTopic::Description:
    case TakeTopic::Other: return {};
  }
  return {};
}

Status Tracking::use_image(const TakeRecord& record) {
  const std::optional<BlobFrame> frame = read_image(record);
  if (!frame || frame->exposed_at < start_) return {};  // the lead-in has those before the start
  sets_->add(*frame);
  return into_ == nullptr ? Status{} : into_->append(*frame);
}

// With its id in the settings; empty: it is damaged, or its camera is left out.
std::optional<BlobFrame> Tracking::read_image(const TakeRecord& record) {
  Result<BlobFrame> frame = take::blobs_of(record);
  if (!frame || !is_consistent(*frame, record)) {
    ++report_.damaged;
    return std::nullopt;
  }
  frame->camera = camera_ids_[frame->camera.value];
  if (!frame->camera.names_something()) return std::nullopt;
  return *std::move(frame);
}

bool Tracking::is_consistent(const BlobFrame& frame, const TakeRecord& record) const {
  const auto soon = [&](Timestamp later) {
    return later >= record.at - kLongestDelay && later <= record.at + kLongestDelay;
  };
  if (frame.camera.value >= camera_ids_.size() || frame.exposed_at != record.at) return false;
  const CameraId id = camera_ids_[frame.camera.value];
  return soon(frame.received_at) && soon(frame.detected_at) &&
         (!id.names_something() || has_possible_blobs(frame, settings_.rig[id.value]));
}

Status Tracking::use_snapshot(const TakeRecord& record) {
  Result<v1::Snapshot> message = take::snapshot_message_of(record);
  if (!message || message->instants().exposed_at_ns() != to_ns(record.at)) {
    ++report_.damaged;
    return {};
  }
  sets_->add(RecordedSnapshot{*std::move(message), std::string(record.bytes)});
  return {};
}

Status Tracking::track_sets(Timestamp read_up_to, const GoOn& progress) {
  while (const std::optional<TakeSet> set = sets_->next(read_up_to)) {
    if (set->frames.exposed_at < part_.from) continue;
    is_behind_ = set->frames.exposed_at > part_.to;
    if (is_behind_) return {};
    if (const Status tracked = track(*set); !tracked) return tracked;
    if (report_.sets % kSetsPerProgress == 0 && !progress({share_of(set->frames.exposed_at), report_.sets})) {
      return Error{ErrorCode::EndOfStream, "the tracking was ended"};
    }
  }
  return {};
}

Status Tracking::track(const TakeSet& set) {
  if (set.frames.exposed_at <= tracked_up_to_) {  // the daemon's sets come in the order of their exposure
    ++report_.damaged;
    return {};
  }
  tracked_up_to_ = set.frames.exposed_at;
  const Result<const Snapshot*> snapshot = tracker_.step(set.frames);
  if (!snapshot) return snapshot.error();
  report_.missing_views += set.missing_views;
  if (set.frames.exposed_at < start_) return learn(set);
  ++report_.sets;
  if (into_ == nullptr) return {};
  if (const Status learnt = learn(set); !learnt) return learnt;
  const Result<bool> same = into_->append(**snapshot, set);
  if (!same) return same.error();
  report_.recorded += set.recorded ? 1 : 0;
  report_.equal += *same ? 1 : 0;
  if (set.recorded && !*same && !report_.first_difference) report_.first_difference = set.frames.number;
  return {};
}

Status Tracking::learn(const TakeSet& set) {
  const std::optional<SubjectFit>& fit = tracker_.fit();
  return fit && into_ != nullptr ? into_->learn(*fit, set.frames.exposed_at) : Status{};
}

double Tracking::share_of(Timestamp at) const {
  const Timestamp first = std::max(take_.first_at(), part_.from), last = std::min(take_.last_at(), part_.to);
  return last > first ? std::clamp(to_s(at - first) / to_s(last - first), 0.0, 1.0) : 1.0;
}

}  // namespace mocap::retrack
