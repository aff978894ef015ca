#include "lib/retrack/retrack.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>
#include <vector>

#include "assemble.h"
#include "lib/offline/offline_tracks.h"
#include "lib/retrack/aligned_sets.h"
#include "lib/retrack/made_of.h"
#include "lib/retrack/new_take.h"
#include "lib/retrack/recorded_sets.h"
#include "lib/retrack/set_tracker.h"
#include "take/take_belief.h"
#include "take/take_name.h"

namespace mocap::retrack {
namespace {

namespace fs = std::filesystem;

using take::TakeRecord;
using take::TakeTopic;

constexpr std::uint64_t kSetsPerProgress = 100;
// Of the time of --preset offline: reading with the forward pass, and the backward pass.
constexpr double kShareOfCollecting = 0.5, kShareOfBackward = 0.45;
// An image takes less time to arrive and to be processed; a longer one is damage.
constexpr Duration kLongestDelay = std::chrono::hours(1);

Error wrong(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

// The ids in the settings of the cameras of a take, found by name.
std::vector<CameraId> ids_in(const settings::DaemonSettings& settings, const Description& recorded) {
  std::vector<CameraId> ids;
  for (const CameraModel& camera : recorded.cameras) {
    const auto found = std::ranges::find(settings.rig, camera.name, &CameraModel::name);
    const auto index = static_cast<std::uint32_t>(found - settings.rig.begin());
    ids.push_back(found == settings.rig.end() ? CameraId{} : CameraId{index});
  }
  return ids;
}

// Whether a camera of this image size can have seen the blobs. Other numbers are damage, which the tracking must not
// calculate with.
bool has_possible_blobs(const BlobFrame& frame, const CameraModel& camera) {
  const double pixels = static_cast<double>(camera.width_px) * camera.height_px;
  return std::ranges::all_of(frame.blobs, [&](const Blob& blob) {
    const double x_px = blob.centroid.v.x(), y_px = blob.centroid.v.y();
    return x_px >= -1.0 && x_px <= camera.width_px && y_px >= -1.0 && y_px <= camera.height_px &&
           blob.sigma_px <= camera.width_px && blob.area_px2 >= 0.0 && blob.area_px2 <= pixels;
  });
}

bool has_images(const take::TakeReader& take) {
  return std::ranges::any_of(
      take.counts(), [](const auto& topic) { return topic.first.starts_with(take::kBlobsTopics) && topic.second > 0; });
}

// Whether the take has the first set of its run, before any body was fitted.
Result<bool> begins_with_run(const take::TakeReader& take, const Description& first) {
  const auto known = take.info().others.find(take::kFirstSetOfRun);
  if (known == take.info().others.end() || first.version != 1) return false;
  take::TakeCursor cursor = take.messages({{TakeTopic::Snapshot}, {}, {}});
  const auto record = cursor.next();
  if (!record) return record.error();
  if (!*record) return false;
  const Result<v1::Snapshot> snapshot = take::snapshot_message_of(**record);
  return snapshot && std::to_string(snapshot->number()) == known->second;
}

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

Status check_new_file(const RetrackOrder& order) {
  const fs::path& out = order.out;
  if (out.extension() != ".mcap") {
    return wrong(fmt::format("--out is '{}', expected a name that ends in .mcap", out.string()));
  }
  if (order.resume || !is_there(out)) return {};
  const fs::path folder = out.parent_path().empty() ? fs::path(".") : out.parent_path();
  return wrong(fmt::format("'{}' exists; the next free name is '{}'", out.string(),
                           (out.parent_path() / (take::free_name(folder, out.stem().string()) + ".mcap")).string()));
}

// What is told of a new take that an earlier order made.
Result<RetrackReport> keep(const RetrackOrder& order, const std::string& digest) {
  const Result<bool> same = is_made_of(order.out, digest);
  if (!same) return same.error();
  if (!*same) {
    return wrong(fmt::format(
        "'{}' exists, but is damaged or was made of another take, with other settings or by another version; "
        "it is kept: move it away or choose another name",
        order.out.string()));
  }
  RetrackReport report;
  report.path = order.out.string();
  report.kept = true;
  return report;
}

// Reads a take once, from its start to its end, and tracks its sets.
class Tracking {
 public:
  // `into`: null if there are no snapshots to be written yet.
  Tracking(const take::TakeReader& take, const settings::DaemonSettings& settings, std::vector<CameraId> camera_ids,
           std::unique_ptr<SetSource> sets, SetTracker& tracker, NewTake* into)
      : take_(take),
        settings_(settings),
        camera_ids_(std::move(camera_ids)),
        sets_(std::move(sets)),
        tracker_(tracker),
        into_(into) {}

  Status run(const Span& span, const GoOn& progress) {
    take::TakeCursor cursor = take_.messages();
    for (;;) {
      const Result<std::optional<TakeRecord>> record = cursor.next();
      if (!record && record.error().code != ErrorCode::InvalidArgument) return record.error();
      if (!record) {
        ++report_.damaged;  // the cursor goes on behind the damaged chunk
        continue;
      }
      const bool ended = !*record;
      if (const Status tracked = track_sets(ended ? Timestamp::max() : (*record)->at, span, progress); !tracked) {
        return tracked;
      }
      if (ended || is_behind_) return {};
      if (const Status used = use(**record); !used) return used;
    }
  }

  // Tracks the sets between the belief and the start of the take, which are not part of it. Before `run`.
  Status run_lead_in(const v1::Belief& belief, Timestamp start) {
    start_ = start;
    for (const v1::Snapshot& set : belief.sets()) sets_->add(RecordedSnapshot{set, {}});
    std::vector<const v1::CameraBlobs*> images;
    for (const v1::CameraBlobs& image : belief.images()) images.push_back(&image);
    std::ranges::stable_sort(images, {}, [](const v1::CameraBlobs* image) { return image->exposed_at_ns(); });
    for (const v1::CameraBlobs* image : images) {
      const Timestamp at = from_ns(image->exposed_at_ns());
      if (const Status tracked = track_sets(at, {}, [](const auto&) { return true; }); !tracked) return tracked;
      const std::string bytes = image->SerializeAsString();
      if (const auto frame = read_image({TakeTopic::Blobs, at, bytes})) sets_->add(*frame);
    }
    return {};
  }

  const RetrackReport& report() const noexcept { return report_; }

 private:
  Status use(const TakeRecord& record) {
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

  Status use_image(const TakeRecord& record) {
    const std::optional<BlobFrame> frame = read_image(record);
    if (!frame || frame->exposed_at < start_) return {};  // the lead-in has those before the start
    sets_->add(*frame);
    return into_ == nullptr ? Status{} : into_->append(*frame);
  }

  // With its id in the settings; empty: it is damaged, or its camera is left out.
  std::optional<BlobFrame> read_image(const TakeRecord& record) {
    Result<BlobFrame> frame = take::blobs_of(record);
    if (!frame || !is_consistent(*frame, record)) {
      ++report_.damaged;
      return std::nullopt;
    }
    frame->camera = camera_ids_[frame->camera.value];
    if (!frame->camera.names_something()) return std::nullopt;
    return *std::move(frame);
  }

  bool is_consistent(const BlobFrame& frame, const TakeRecord& record) const {
    const auto soon = [&](Timestamp later) {
      return later >= record.at - kLongestDelay && later <= record.at + kLongestDelay;
    };
    if (frame.camera.value >= camera_ids_.size() || frame.exposed_at != record.at) return false;
    const CameraId id = camera_ids_[frame.camera.value];
    return soon(frame.received_at) && soon(frame.detected_at) &&
           (!id.names_something() || has_possible_blobs(frame, settings_.rig[id.value]));
  }

  Status use_snapshot(const TakeRecord& record) {
    Result<v1::Snapshot> message = take::snapshot_message_of(record);
    if (!message || message->instants().exposed_at_ns() != to_ns(record.at)) {
      ++report_.damaged;
      return {};
    }
    sets_->add(RecordedSnapshot{*std::move(message), std::string(record.bytes)});
    return {};
  }

  Status track_sets(Timestamp read_up_to, const Span& span, const GoOn& progress) {
    while (const std::optional<TakeSet> set = sets_->next(read_up_to)) {
      is_behind_ = set->frames.exposed_at > span.to;
      if (is_behind_) return {};
      if (const Status tracked = track(*set); !tracked) return tracked;
      if (report_.sets % kSetsPerProgress == 0 && !progress({share_of(set->frames.exposed_at), report_.sets})) {
        return Error{ErrorCode::EndOfStream, "the tracking was ended"};
      }
    }
    return {};
  }

  Status track(const TakeSet& set) {
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

  Status learn(const TakeSet& set) {
    const std::optional<SubjectFit>& fit = tracker_.fit();
    return fit && into_ != nullptr ? into_->learn(*fit, set.frames.exposed_at) : Status{};
  }

  double share_of(Timestamp at) const {
    const double whole_s = to_s(take_.last_at() - take_.first_at());
    return whole_s > 0.0 ? std::clamp(to_s(at - take_.first_at()) / whole_s, 0.0, 1.0) : 1.0;
  }

  const take::TakeReader& take_;
  const settings::DaemonSettings& settings_;
  std::vector<CameraId> camera_ids_;
  std::unique_ptr<SetSource> sets_;
  SetTracker& tracker_;
  NewTake* into_;
  Timestamp tracked_up_to_ = Timestamp::min();
  bool is_behind_ = false;              // a set after the span came
  Timestamp start_ = Timestamp::min();  // what was exposed before belongs to the lead-in
  RetrackReport report_;
};

// The sets that the daemon fused, unless others are wanted or the take has none.
std::unique_ptr<SetSource> source_of(const RetrackOrder& order, const take::TakeReader& take,
                                     const settings::DaemonSettings& settings, const std::vector<CameraId>& ids) {
  const auto cameras = static_cast<std::uint32_t>(settings.rig.size());
  const auto counts = take.counts();
  const auto snapshots = counts.find(std::string(take::kSnapshotTopic));
  if (order.every_set || snapshots == counts.end() || snapshots->second == 0) {
    return std::make_unique<AlignedSets>(settings.pipeline.align, cameras);
  }
  return std::make_unique<RecordedSets>(ids, cameras);
}

// Reports a part of the work as its share of the whole.
GoOn from_share(double from, double to, const GoOn& progress) {
  return [=](const RetrackProgress& part) { return progress({from + (to - from) * part.share, part.sets}); };
}

// The sets of the whole take, tracked forwards and backwards.
Result<std::unique_ptr<offline::OfflineTracks>> collect(const RetrackOrder& order, const take::TakeReader& take,
                                                        const settings::DaemonSettings& settings,
                                                        const std::vector<CameraId>& ids, const GoOn& progress) {
  auto tracks = offline::OfflineTracks::create(settings, order.out.parent_path());
  if (!tracks) return tracks.error();
  OfflineTracker tracker(**tracks);
  Tracking reading(take, settings, ids, source_of(order, take, settings, ids), tracker, nullptr);
  const Status read = reading.run({}, from_share(0.0, kShareOfCollecting, progress));
  if (!read) return read.error();
  const auto passed = from_share(kShareOfCollecting, kShareOfCollecting + kShareOfBackward, progress);
  const Status back = (*tracks)->finish([&](double share) { return passed({share, reading.report().sets}); });
  if (!back) return back.error();
  return tracks;
}

Timestamp start_of(const take::TakeReader& take) { return take.info().started_at.value_or(take.first_at()); }

// Copies the belief to the files of the new take, so that a later order can begin with it too.
void pass_on_belief(const take::TakeReader& take, std::vector<TakeFile>& files) {
  Result<std::string> bytes = take.file(take::kBeliefFile);
  if (bytes) files.push_back({take::kBeliefFile, take::kBeliefMediaType, *std::move(bytes)});
}

Span span_of(const RetrackOrder& order, const take::TakeReader& take, bool has_belief) {
  const Timestamp start = start_of(take);
  Span span{.from = has_belief ? start : Timestamp::min()};
  if (order.from) span.from = start + *order.from;
  if (order.to) span.to = start + *order.to;
  return span;
}

// A fusion with the belief that the take begins with.
struct Restored {
  v1::Belief belief;
  std::unique_ptr<LiveTracker> tracker;
};

// Empty: the order is not to track the take as it was, or the take has no belief that this version can read.
std::optional<Restored> restore(const RetrackOrder& order, const take::TakeReader& take,
                                const settings::DaemonSettings& settings, const std::string& producer) {
  const bool same_settings = order.others.settings.empty() && order.others.rig.empty() && order.others.subjects.empty();
  if (order.offline || order.every_set || !same_settings) return std::nullopt;
  Result<std::optional<v1::Belief>> belief = take::belief_of(take);
  if (!belief || !*belief || (*belief)->producer() != producer) return std::nullopt;
  Restored restored{std::move(**belief), std::make_unique<LiveTracker>(settings)};
  if (!restored.tracker->restore(restored.belief.state())) return std::nullopt;
  return restored;
}

Result<take::TakeReader> open_take(const RetrackOrder& order) {
  Result<take::TakeReader> take = take::TakeReader::open(order.take);
  if (!take || has_images(*take)) return take;
  return wrong(
      fmt::format("'{}': has no images of blobs to be tracked; record with [takes] blobs = true", order.take.string()));
}

}  // namespace

Result<RetrackReport> retrack(const RetrackOrder& order, const GoOn& progress) {
  if (const Status is_new = check_new_file(order); !is_new) return is_new.error();
  const Result<take::TakeReader> take = open_take(order);
  if (!take) return take.error();
  const Result<Description> recorded = take->description();
  if (!recorded) return recorded.error();
  const Result<bool> from_start = begins_with_run(*take, *recorded);
  if (!from_start) return from_start.error();
  Result<TakeSettings> loaded = load_take_settings(*take, order.others);
  if (!loaded) return loaded.error();
  settings::DaemonSettings& settings = *loaded->settings;
  const std::string producer = describe(settings, "").producer;
  std::optional<Restored> restored = *from_start ? std::nullopt : restore(order, *take, settings, producer);
  if (!restored && !*from_start && order.others.subjects.empty()) use_bodies(*recorded, settings);

  const Result<std::string> digest = made_of(order, loaded->files, producer);
  if (!digest) return digest.error();
  if (order.resume && is_there(order.out)) return keep(order, *digest);

  const std::vector<CameraId> ids = ids_in(settings, *recorded);
  if (std::ranges::none_of(ids, [](CameraId id) { return id.names_something(); })) {
    return wrong(fmt::format("'{}': the settings have none of its cameras", order.take.string()));
  }
  const Span span = span_of(order, *take, restored.has_value());
  Description description = describe(settings, recorded->session_id);
  std::unique_ptr<offline::OfflineTracks> tracks;
  std::unique_ptr<SetTracker> tracker;
  if (order.offline) {
    auto collected = collect(order, *take, settings, ids, progress);
    if (!collected) return collected.error();
    tracks = *std::move(collected);
    description = describe(tracks->settings(), recorded->session_id);
    auto offline = std::make_unique<OfflineTracker>(*tracks);
    offline->begin_again();
    tracker = std::move(offline);
  } else if (restored) {
    description = restored->tracker->describe(std::move(description));
    if (!order.from) pass_on_belief(*take, loaded->files);
    tracker = std::move(restored->tracker);
  } else {
    tracker = std::make_unique<LiveTracker>(settings);
  }
  Result<NewTake> into = NewTake::create(order.out, *take, span, {description, std::move(loaded->files), *digest});
  if (!into) return into.error();
  Tracking tracking(*take, settings, ids, source_of(order, *take, settings, ids), *tracker, &*into);
  const GoOn go_on = from_share(order.offline ? kShareOfCollecting + kShareOfBackward : 0.0, 1.0, progress);
  Status tracked;
  if (restored) tracked = tracking.run_lead_in(restored->belief, start_of(*take));
  if (tracked) tracked = tracking.run(span, go_on);
  if (!tracked) return tracked.error();
  Result<std::string> path = into->finish();
  if (!path) return path.error();
  RetrackReport report = tracking.report();
  report.path = *std::move(path);
  report.seconds = to_s(std::min(take->last_at(), span.to) - take->first_at());
  report.from_start_of_run = *from_start;
  report.from_belief = restored.has_value();
  return report;
}

}  // namespace mocap::retrack
