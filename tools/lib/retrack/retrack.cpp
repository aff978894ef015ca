#include "lib/retrack/retrack.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "assemble.h"
#include "lib/offline/offline_tracks.h"
#include "lib/retrack/aligned_sets.h"
#include "lib/retrack/chunk.h"
#include "lib/retrack/made_of.h"
#include "lib/retrack/new_take.h"
#include "lib/retrack/recorded_sets.h"
#include "lib/retrack/set_tracker.h"
#include "lib/retrack/tracking.h"
#include "take/take_belief.h"
#include "take/take_name.h"

namespace mocap::retrack {
namespace {

namespace fs = std::filesystem;

using take::TakeTopic;

// Of the time of --preset offline: reading with the forward pass, and the backward pass.
constexpr double kShareOfCollecting = 0.5, kShareOfBackward = 0.45;

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
  if (order.resume) return {};
  if (order.chunk && is_there(chunk_file(out, *order.chunk))) {
    return wrong(fmt::format("'{}' exists; --resume keeps it if it is whole and of this take",
                             chunk_file(out, *order.chunk).string()));
  }
  if (!is_there(out)) return {};
  const fs::path folder = out.parent_path().empty() ? fs::path(".") : out.parent_path();
  return wrong(fmt::format("'{}' exists; the next free name is '{}'", out.string(),
                           (out.parent_path() / (take::free_name(folder, out.stem().string()) + ".mcap")).string()));
}

// The file to be written.
fs::path out_of(const RetrackOrder& order) { return order.chunk ? chunk_file(order.out, *order.chunk) : order.out; }

// Makes the folder of the chunks, if it is needed.
Status make_folder(const RetrackOrder& order) {
  if (!order.chunk) return {};
  const fs::path folder = chunk_folder(order.out);
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error) return {};
  return Error{ErrorCode::Io, fmt::format("the folder '{}' cannot be made: {}", folder.string(), error.message())};
}

// The report of a file that an earlier order made.
Result<RetrackReport> keep(const fs::path& path, const std::string& made_of) {
  if (const Status same = check_made_of(path, made_of); !same) return same.error();
  RetrackReport report;
  report.path = path.string();
  report.kept = true;
  return report;
}

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

// The sets of a part of the take, tracked forwards and backwards.
Result<std::unique_ptr<offline::OfflineTracks>> collect(const RetrackOrder& order, const take::TakeReader& take,
                                                        const settings::DaemonSettings& settings,
                                                        const std::vector<CameraId>& ids, const Span& part,
                                                        const GoOn& progress) {
  auto tracks = offline::OfflineTracks::create(settings, order.out.parent_path());
  if (!tracks) return tracks.error();
  OfflineTracker tracker(**tracks);
  Tracking reading(take, settings, ids, source_of(order, take, settings, ids), part, tracker, nullptr);
  const Status read = reading.run(from_share(0.0, kShareOfCollecting, progress));
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

// The first chunk begins as the whole take does.
bool begins_take(const RetrackOrder& order) { return !order.chunk || order.chunk->number == 1; }

// The part that the new take has.
Span span_of(const RetrackOrder& order, const take::TakeReader& take, bool has_belief) {
  const Timestamp start = start_of(take);
  Span span;
  if (order.chunk) span = span_of(*order.chunk, take.first_at(), take.last_at());
  if (has_belief) span.from = start;
  if (order.from) span.from = start + *order.from;
  if (order.to) span.to = start + *order.to;
  return span;
}

// The part that is tracked for it.
Span tracked_part(const RetrackOrder& order, const Span& span) {
  return {.from = begins_take(order) ? Timestamp::min() : span.from, .to = span.to};
}

// The description in force where a part of the recording begins.
Result<Description> description_at(const take::TakeReader& take, Description first, Timestamp at) {
  if (at == Timestamp::min()) return first;
  take::TakeCursor cursor = take.messages({.topics = {TakeTopic::Description}, .to = at});
  for (;;) {
    const auto record = cursor.next();
    if (!record && record.error().code != ErrorCode::InvalidArgument) return record.error();
    if (!record) continue;  // damaged
    if (!*record) return first;
    if (Result<Description> later = take::description_of(**record)) first = *std::move(later);
  }
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
  if (!begins_take(order) || order.offline || order.every_set || !same_settings) return std::nullopt;
  Result<std::optional<v1::Belief>> belief = take::belief_of(take);
  if (!belief || !*belief || (*belief)->producer() != producer) return std::nullopt;
  Restored restored{std::move(**belief), std::make_unique<LiveTracker>(settings)};
  if (!restored.tracker->restore(restored.belief.state())) return std::nullopt;
  return restored;
}

Result<take::TakeReader> open_take(const RetrackOrder& order) {
  Result<take::TakeReader> take = take::TakeReader::open(order.take);
  if (!take && take.error().code == ErrorCode::Io) return wrong(take.error().message);  // Io: the new take
  if (!take || has_images(*take)) return take;
  return wrong(
      fmt::format("'{}': has no images of blobs to be tracked; record with [takes] blobs = true", order.take.string()));
}

// Makes the snapshots, and the description that is in force at their beginning.
struct ChosenTracker {
  std::unique_ptr<offline::OfflineTracks> tracks;  // of --preset offline; outlives the tracker
  std::unique_ptr<SetTracker> tracker;
  Description description;
};

// Tracks the part already, if it is tracked offline. `restored`: its tracker is moved from.
Result<ChosenTracker> choose_tracker(const RetrackOrder& order, const take::TakeReader& take,
                                     const Description& recorded, const settings::DaemonSettings& settings,
                                     const std::vector<CameraId>& ids, const Span& part,
                                     std::optional<Restored>& restored, const GoOn& progress) {
  ChosenTracker chosen;
  if (order.offline) {
    auto collected = collect(order, take, settings, ids, order.chunk ? part : Span(), progress);
    if (!collected) return collected.error();
    chosen.tracks = *std::move(collected);
    chosen.description = describe(chosen.tracks->settings(), recorded.session_id);
    auto offline = std::make_unique<OfflineTracker>(*chosen.tracks);
    offline->begin_again();
    chosen.tracker = std::move(offline);
    return chosen;
  }
  chosen.description = describe(settings, recorded.session_id);
  if (restored) {
    chosen.description = restored->tracker->describe(std::move(chosen.description));
    chosen.tracker = std::move(restored->tracker);
  } else {
    chosen.tracker = std::make_unique<LiveTracker>(settings);
  }
  return chosen;
}

}  // namespace

Result<RetrackReport> retrack(const RetrackOrder& order, const GoOn& progress) {
  if (const Status is_new = check_new_file(order); !is_new) return is_new.error();
  const Result<take::TakeReader> take = open_take(order);
  if (!take) return take.error();
  const Result<Description> recorded = take->description();
  if (!recorded) return recorded.error();
  const Result<bool> with_run = begins_with_run(*take, *recorded);
  if (!with_run) return with_run.error();
  const bool from_start = *with_run && begins_take(order);
  Result<TakeSettings> loaded = load_take_settings(*take, order.others);
  if (!loaded) return loaded.error();
  settings::DaemonSettings& settings = *loaded->settings;
  const std::string producer = describe(settings, "").producer;
  std::optional<Restored> restored = from_start ? std::nullopt : restore(order, *take, settings, producer);
  const Span span = span_of(order, *take, restored.has_value());
  const Span part = tracked_part(order, span);
  if (!restored && !from_start && order.others.subjects.empty()) {
    const Result<Description> then = description_at(*take, *recorded, part.from);
    if (!then) return then.error();
    use_bodies(*then, settings);
  }

  const Result<std::string> digest = made_of(order, loaded->files, producer);
  if (!digest) return digest.error();
  if (order.resume && is_there(order.out)) return keep(order.out, *digest);
  const std::string origin = order.chunk ? to_text(ChunkOrigin{*order.chunk, *digest}) : *digest;
  if (order.resume && is_there(out_of(order))) return keep(out_of(order), origin);
  if (const Status made = make_folder(order); !made) return made.error();

  const std::vector<CameraId> ids = ids_in(settings, *recorded);
  if (std::ranges::none_of(ids, [](CameraId id) { return id.names_something(); })) {
    return wrong(fmt::format("'{}': the settings have none of its cameras", order.take.string()));
  }
  auto chosen = choose_tracker(order, *take, *recorded, settings, ids, part, restored, progress);
  if (!chosen) return chosen.error();
  if (restored && !order.from) pass_on_belief(*take, loaded->files);
  Result<NewTake> into =
      NewTake::create(out_of(order), *take, span, {chosen->description, std::move(loaded->files), origin});
  if (!into) return into.error();
  Tracking tracking(*take, settings, ids, source_of(order, *take, settings, ids), part, *chosen->tracker, &*into);
  const GoOn go_on = from_share(order.offline ? kShareOfCollecting + kShareOfBackward : 0.0, 1.0, progress);
  Status tracked;
  if (restored) tracked = tracking.run_lead_in(restored->belief, start_of(*take));
  if (tracked) tracked = tracking.run(go_on);
  if (!tracked) return tracked.error();
  Result<std::string> path = into->finish();
  if (!path) return path.error();
  RetrackReport report = tracking.report();
  report.path = *std::move(path);
  report.seconds = to_s(std::min(take->last_at(), part.to) - std::max(take->first_at(), part.from));
  report.from_start_of_run = from_start;
  report.from_belief = restored.has_value();
  return report;
}

}  // namespace mocap::retrack
