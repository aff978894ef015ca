#include "lib/join/join.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <system_error>
#include <utility>

#include "lib/join/agreement.h"
#include "lib/join/chunk_snapshots.h"
#include "lib/join/chunk_takes.h"
#include "lib/join/joined_take.h"
#include "lib/join/pose_offset.h"
#include "lib/join/track_ids.h"
#include "lib/retrack/made_of.h"
#include "lib/retrack/new_take.h"
#include "take/take_reader.h"

namespace mocap::join {
namespace {

constexpr std::uint64_t kSetsPerProgress = 100;

Error wrong(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

Error ended() { return {ErrorCode::EndOfStream, "the joining was ended"}; }

class Joining {
 public:
  Joining(const ChunkTakes& takes, JoinedTake into, const std::vector<Seam>& seams,
          const std::function<bool(double)>& progress)
      : takes_(takes), into_(std::move(into)), seams_(seams), progress_(progress) {}

  Status run() {
    for (chunk_ = 0; chunk_ < takes_.chunks.size(); ++chunk_) {
      if (const Status copied = copy_chunk(); !copied) return copied;
    }
    return {};
  }

  Result<std::string> finish() { return into_.finish(); }
  std::uint64_t sets() const noexcept { return sets_; }

 private:
  // From the seam with the chunk before it to the seam with the next one.
  Status copy_chunk() {
    retrack::Span part;
    if (chunk_ > 0) part.from = seams_[chunk_ - 1].at;
    if (chunk_ < seams_.size()) part.to = seams_[chunk_].at;
    if (chunk_ > 0) go_over();
    ChunkSnapshots sets(takes_.chunks[chunk_], part);
    for (;;) {
      Result<std::optional<v1::Snapshot>> set = sets.next();
      if (!set) return set.error();
      if (!*set) return {};
      if (sets_ > 0 && time_of(**set) == time_of(last_)) {
        go_on_from(**set, sets.description().subjects);
      } else if (const Status written = write(*std::move(*set), sets.description()); !written) {
        return written;
      }
    }
  }

  void go_over() {
    ids_.go_over();
    offsets_.clear();
  }

  // Ids of tracks and poses go on from a set that is written: `common` is the same in this chunk.
  void go_on_from(const v1::Snapshot& common, const std::vector<Subject>& subjects) {
    ids_.go_on_from(last_, common);
    if (!seams_[chunk_ - 1].agrees) return;
    for (const v1::SubjectState& later : common.subjects()) {
      const v1::SubjectState* earlier = subject_in(last_, later.subject());
      if (earlier == nullptr || later.subject() >= subjects.size()) continue;
      offsets_.try_emplace(later.subject(), *earlier, later, subjects[later.subject()].marker_set.skeleton);
    }
  }

  Status write(v1::Snapshot snapshot, const Description& description) {
    const Timestamp at = time_of(snapshot);
    ids_.renumber(snapshot);
    // A chunk counts sets that are formed anew from its own start.
    const bool begins_anew = sets_ > 0 && snapshot.number() + added_to_numbers_ <= last_.number();
    if (begins_anew) added_to_numbers_ = last_.number() + 1 - snapshot.number();
    snapshot.set_number(snapshot.number() + added_to_numbers_);
    for (v1::SubjectState& subject : *snapshot.mutable_subjects()) {
      const auto offset = offsets_.find(subject.subject());
      if (offset != offsets_.end()) offset->second.add_to(subject, at - seams_[chunk_ - 1].at);
    }
    if (++sets_ % kSetsPerProgress == 0 && !progress_(share_of(at))) {
      return ended();
    }
    last_ = std::move(snapshot);
    return into_.append(last_, chunk_, description);
  }

  double share_of(Timestamp at) const {
    const Timestamp first = takes_.chunks.front().reader.first_at(), last = takes_.chunks.back().reader.last_at();
    return last > first ? std::clamp(to_s(at - first) / to_s(last - first), 0.0, 1.0) : 1.0;
  }

  const ChunkTakes& takes_;
  JoinedTake into_;
  const std::vector<Seam>& seams_;
  const std::function<bool(double)>& progress_;
  std::size_t chunk_ = 0;
  TrackIds ids_;
  std::map<std::uint32_t, PoseOffset> offsets_;  // by subject
  std::uint64_t added_to_numbers_ = 0;           // modulo 2^64
  v1::Snapshot last_;                            // that was written
  std::uint64_t sets_ = 0;
};

Result<std::vector<Seam>> seams_of(const ChunkTakes& takes, const std::function<bool(double)>& progress) {
  std::vector<Seam> seams;
  for (std::size_t i = 0; i + 1 < takes.chunks.size(); ++i) {
    if (!progress(0.0)) return ended();
    retrack::Span overlap{takes.chunks[i + 1].part.from, takes.chunks[i].part.to};
    if (i > 0) overlap.from = std::max(overlap.from, takes.chunks[i - 1].part.to + Duration(1));
    const Result<Seam> seam = find_seam(takes.chunks[i], takes.chunks[i + 1], overlap);
    if (!seam) return seam.error();
    seams.push_back(*seam);
  }
  return seams;
}

// The digest of the inputs of an existing take.
Result<std::string> recorded_made_of(const std::filesystem::path& path) {
  const Result<take::TakeReader> take = take::TakeReader::open(path);
  if (!take) return take.error();
  const auto known = take->info().others.find(retrack::kMadeOf);
  if (known != take->info().others.end()) return known->second;
  return wrong(fmt::format("'{}' exists, and is no joined take; choose another name", path.string()));
}

// The report of a joined take that is there already. Once it is whole, its chunks are removed, one after the other.
Result<JoinReport> keep(const JoinOrder& order) {
  const Result<std::string> digest = order.chunks.empty() ? recorded_made_of(order.out) : made_of(order.chunks);
  if (!digest) return digest.error();
  if (const Status right = retrack::check_made_of(order.out, *digest); !right) return right.error();
  JoinReport report;
  report.path = order.out.string();
  report.kept = true;
  return report;
}

}  // namespace

Result<JoinReport> join(const JoinOrder& order, const std::function<bool(double)>& progress) {
  if (order.out.extension() != ".mcap") {
    return wrong(fmt::format("--out is '{}', expected a name that ends in .mcap", order.out.string()));
  }
  std::error_code ignored;
  const bool is_there = std::filesystem::exists(order.out, ignored);
  if (is_there && !order.resume) return wrong(fmt::format("'{}' exists; choose another name", order.out.string()));
  if (is_there) return keep(order);
  const Result<ChunkTakes> takes = open_chunks(order.chunks);
  if (!takes) return takes.error();
  Result<std::vector<Seam>> seams = seams_of(*takes, progress);
  if (!seams) return seams.error();
  Result<JoinedTake> into = JoinedTake::create(order.out, *takes);
  if (!into) return into.error();
  Joining joining(*takes, *std::move(into), *seams, progress);
  if (const Status joined = joining.run(); !joined) return joined.error();
  Result<std::string> path = joining.finish();
  if (!path) return path.error();
  JoinReport report;
  report.path = *std::move(path);
  report.sets = joining.sets();
  report.start = takes->chunks.front().reader.info().started_at.value();
  report.seams = *std::move(seams);
  return report;
}

}  // namespace mocap::join
