#include "lib/scoring/clear_mot.h"

#include <algorithm>
#include <cstddef>

namespace mocap::scoring {
namespace {

constexpr std::size_t kMost = 2048;
constexpr std::size_t kMostPairs = 1 << 16;
// Cost of an unassigned object or track. It exceeds any distance, so that the number of matches is maximised first.
constexpr double kUnassignedCost = 1e6;

}  // namespace

std::optional<double> ClearMot::Counts::mota() const {
  if (objects == 0) return std::nullopt;
  return 1.0 - static_cast<double>(misses + false_positives + switches) / static_cast<double>(objects);
}

std::optional<double> ClearMot::Counts::motp() const {
  if (detections() == 0) return std::nullopt;
  return distance / static_cast<double>(detections());
}

ClearMot::ClearMot() : assigner_(kMost, kMost, kMostPairs) {}

void ClearMot::match(std::uint64_t object, std::uint64_t track, double distance) {
  const auto [before, first] = last_.try_emplace(object, track);
  const bool switched = !first && before->second != track;
  before->second = track;
  ++(switched ? counts_.switches : counts_.matches);
  counts_.distance += distance;
}

void ClearMot::add(std::span<const std::uint64_t> objects, std::span<const std::uint64_t> tracks,
                   std::span<const MotPair> allowed) {
  object_taken_.assign(objects.size(), false);
  track_taken_.assign(tracks.size(), false);
  const std::uint64_t before = counts_.detections();
  for (const MotPair& pair : allowed) {
    const auto kept = last_.find(objects[pair.object]);
    const bool together = kept != last_.end() && kept->second == tracks[pair.track];
    if (!together || object_taken_[pair.object] || track_taken_[pair.track]) continue;
    object_taken_[pair.object] = track_taken_[pair.track] = true;
    match(objects[pair.object], tracks[pair.track], pair.distance);
  }
  pairs_.clear();
  for (const MotPair& pair : allowed) {
    const bool left = !object_taken_[pair.object] && !track_taken_[pair.track];
    if (left && pairs_.size() < kMostPairs) pairs_.push_back({pair.object, pair.track, pair.distance});
  }
  const std::size_t rows = std::min(objects.size(), kMost), columns = std::min(tracks.size(), kMost);
  const auto column_of = assigner_.assign(rows, columns, pairs_, kUnassignedCost);
  for (std::uint32_t row = 0; row < rows; ++row) {
    if (column_of[row] == geometry::Assigner::kUnassigned) continue;
    const auto pair = std::ranges::find_if(
        pairs_, [&](const geometry::AllowedPair& p) { return p.row == row && p.column == column_of[row]; });
    match(objects[row], tracks[column_of[row]], pair->cost);
  }
  const std::uint64_t found = counts_.detections() - before;
  counts_.objects += objects.size();
  counts_.predictions += tracks.size();
  counts_.misses += objects.size() - found;
  counts_.false_positives += tracks.size() - found;
}

}  // namespace mocap::scoring
