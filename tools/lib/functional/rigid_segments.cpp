#include "lib/functional/rigid_segments.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace mocap::functional {
namespace {

// Fraction of the distances that is kept: exchanged labels give outliers. Chosen by hand; not yet measured.
constexpr double kKeptFraction = 0.99;

// The standard deviation of the distance of two markers, m, without the distances that deviate most; infinite if too
// few frames have both.
double deviation_m(const bodyfit::LabelledTake& take, std::size_t a, std::size_t b, const SegmentSettings& settings,
                   std::vector<double>& distances) {
  distances.clear();
  for (std::size_t f = 0; f < take.frames(); ++f) {
    const auto frame = take.frame(f);
    const double apart = (frame[a] - frame[b]).norm();
    if (std::isfinite(apart)) distances.push_back(apart);
  }
  const std::size_t least = std::max<std::size_t>(2, std::min(settings.min_frames, take.frames()));
  if (distances.size() < least) return std::numeric_limits<double>::infinity();
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  const double median = *middle;
  std::ranges::sort(distances, {}, [&](double apart) { return std::abs(apart - median); });
  distances.resize(
      std::max<std::size_t>(1, static_cast<std::size_t>(kKeptFraction * static_cast<double>(distances.size()))));
  double sum = 0.0, squares = 0.0;
  for (const double apart : distances) {
    sum += apart - median;
    squares += (apart - median) * (apart - median);
  }
  const auto count = static_cast<double>(distances.size());
  return std::sqrt(std::max(0.0, squares / count - (sum / count) * (sum / count)));
}

}  // namespace

std::vector<Segment> find_rigid_segments(const bodyfit::LabelledTake& take, const SegmentSettings& settings) {
  std::vector<Segment> segments;
  for (std::size_t m = 0; m < take.markers; ++m) segments.push_back({m});
  const auto count = static_cast<Eigen::Index>(take.markers);
  Eigen::MatrixXd largest_deviation_m =
      Eigen::MatrixXd::Constant(count, count, std::numeric_limits<double>::infinity());
  std::vector<double> distances;
  for (Eigen::Index a = 0; a < count; ++a) {
    for (Eigen::Index b = 0; b < a; ++b) {
      largest_deviation_m(a, b) =
          deviation_m(take, static_cast<std::size_t>(a), static_cast<std::size_t>(b), settings, distances);
    }
  }
  for (;;) {
    Eigen::Index one = 0, other = 0;
    if (count < 2 || largest_deviation_m.minCoeff(&one, &other) > settings.max_deviation_m) break;
    Segment& into = segments[static_cast<std::size_t>(other)];  // other < one
    Segment& from = segments[static_cast<std::size_t>(one)];
    into.insert(into.end(), from.begin(), from.end());
    from.clear();
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto between = [&](Eigen::Index a, Eigen::Index b) -> double& {
        return largest_deviation_m(std::max(a, b), std::min(a, b));
      };
      if (k == one || k == other) continue;
      between(other, k) = std::max(between(other, k), between(one, k));
      between(one, k) = std::numeric_limits<double>::infinity();
    }
    largest_deviation_m(one, other) = std::numeric_limits<double>::infinity();
  }
  std::erase_if(segments, [](const Segment& segment) { return segment.empty(); });
  for (Segment& segment : segments) std::ranges::sort(segment);
  return segments;
}

}  // namespace mocap::functional
