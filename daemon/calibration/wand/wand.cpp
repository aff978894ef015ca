#include "calibration/wand/wand.h"

#include <algorithm>

namespace mocap::calibration {
namespace {

// A candidate whose cost is within this of the best one leaves the detection ambiguous. A cost of 1 is one tolerance.
// Chosen by hand; not yet measured.
constexpr double kAmbiguityMargin = 0.5;

struct Candidate {
  WandBlobs blobs;
  double cost = 0.0;
};

bool share_a_blob(const WandBlobs& a, const WandBlobs& b) {
  return std::ranges::any_of(a, [&](int blob) { return blob >= 0 && std::ranges::find(b, blob) != b.end(); });
}

// Squared deviations from the line and from the division ratio, in tolerances, of three blobs as a wand with the first
// marker at `from`. Negative: outside the tolerances.
double candidate_cost(const Eigen::Vector2d& from, const Eigen::Vector2d& middle, const Eigen::Vector2d& to,
                      double wand_ratio, const WandTolerance& tolerance) {
  const Eigen::Vector2d along = to - from;
  const double length = along.norm();
  if (length < tolerance.min_length_px) return -1.0;
  const Eigen::Vector2d u = along / length;
  const Eigen::Vector2d offset = middle - from;
  const double max_offset = tolerance.offset_px + tolerance.offset_fraction * length;
  const double line = std::abs(u.x() * offset.y() - u.y() * offset.x()) / max_offset;
  const double ratio = std::abs(u.dot(offset) / length - wand_ratio) / tolerance.ratio_tolerance;
  return line <= 1.0 && ratio <= 1.0 ? line * line + ratio * ratio : -1.0;
}

std::vector<Candidate> three_marker_candidates(std::span<const Eigen::Vector2d> blobs, const Wand& wand,
                                               const WandTolerance& tolerance) {
  std::vector<Candidate> candidates;
  const double wand_ratio = wand.marks_m[1] / wand.length_m();
  const auto n = static_cast<int>(blobs.size());
  const auto at = [&](int i) { return blobs[static_cast<std::size_t>(i)]; };
  for (int from = 0; from < n; ++from) {
    for (int to = 0; to < n; ++to) {
      if (to == from || (wand.is_symmetric() && to < from)) continue;
      for (int middle = 0; middle < n; ++middle) {
        if (middle == from || middle == to) continue;
        const double cost = candidate_cost(at(from), at(middle), at(to), wand_ratio, tolerance);
        if (cost >= 0.0) candidates.push_back({{from, middle, to}, cost});
      }
    }
  }
  return candidates;
}

}  // namespace

WandTolerance wand_tolerance(bool lenses_known) {
  WandTolerance tolerance;
  if (!lenses_known) {
    tolerance.offset_px = 2.0;
    tolerance.offset_fraction = 0.03;
  }
  return tolerance;
}

WandDetection detect_wand(std::span<const Eigen::Vector2d> blobs_px, const Wand& wand, const WandTolerance& tolerance) {
  WandDetection detection;
  if (blobs_px.size() > tolerance.max_blobs) return detection;
  if (wand.marks_m.size() == 2) {
    detection.found = blobs_px.size() == 2 && (blobs_px[1] - blobs_px[0]).norm() >= tolerance.min_length_px;
    if (detection.found) detection.blobs = {0, 1, -1};
    detection.two_wands = blobs_px.size() == 4;
    return detection;
  }
  const std::vector<Candidate> candidates = three_marker_candidates(blobs_px, wand, tolerance);
  if (candidates.empty()) return detection;
  const auto best = std::ranges::min_element(candidates, {}, &Candidate::cost);
  detection.blobs = best->blobs;
  detection.found = std::ranges::none_of(candidates, [&](const Candidate& other) {
    return &other != &*best && other.cost < best->cost + kAmbiguityMargin;
  });
  detection.two_wands =
      std::ranges::any_of(candidates, [&](const Candidate& other) { return !share_a_blob(other.blobs, best->blobs); });
  return detection;
}

}  // namespace mocap::calibration
