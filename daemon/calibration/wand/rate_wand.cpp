#include "calibration/wand/rate_wand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "calibration/median.h"
#include "calibration/sighting_of.h"
#include "geometry/lens.h"
#include "geometry/triangulation.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector3d;

constexpr int kFields = 8;  // of an image, each way
struct Sum {
  double squares = 0.0;
  std::size_t points = 0;
  std::array<bool, kFields * kFields> fields{};
};

void add(const Bundle& bundle, const Sight& sight, Sum& sum) {
  const auto residual = bundle.residual_px(sight);
  if (!residual) return;
  const CameraModel& camera = bundle.rig[static_cast<std::size_t>(sight.camera)];
  sum.squares += residual->squaredNorm();
  ++sum.points;
  const auto field = [](double at, int size) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>(at * kFields / size), 0, kFields - 1));
  };
  sum.fields[field(sight.px.y(), camera.height_px) * kFields + field(sight.px.x(), camera.width_px)] = true;
}

// One marker at one place, by rays alone; nothing where two cameras do not see it.
std::optional<Vector3d> point_of(const Bundle& bundle, std::span<const Sight> sights, int mark) {
  std::vector<geometry::Sighting> rays;
  for (const Sight& sight : sights) {
    if (sight.mark != mark) continue;
    const CameraModel& camera = bundle.rig[static_cast<std::size_t>(sight.camera)];
    const auto ray = geometry::undistort(camera.lens, {sight.px});
    if (!ray) continue;
    rays.push_back(sighting_of(camera, *ray, sight.sigma_px));
  }
  const auto start = geometry::triangulate(rays);
  if (!start) return std::nullopt;
  const auto refined = geometry::refine(rays, *start);
  if (!refined) return std::nullopt;
  return refined->point.v;
}

// The sights of each place; they stand together.
void each_place(const Bundle& bundle, const auto& look) {
  const std::span<const Sight> sights(bundle.sights);
  for (std::size_t from = 0; from < sights.size();) {
    std::size_t to = from;
    while (to < sights.size() && sights[to].place == sights[from].place) ++to;
    look(sights.subspan(from, to - from));
    from = to;
  }
}

void rate_length(WandSolution& solution) {
  const std::vector<double> lengths = wand_lengths_m(solution.bundle);
  if (lengths.empty()) return;
  double sum = 0.0;
  for (const double length : lengths) sum += length;
  solution.length_mean_m = sum / static_cast<double>(lengths.size());
  double squares = 0.0;
  for (const double length : lengths) squares += (length - solution.length_mean_m) * (length - solution.length_mean_m);
  solution.length_std_m = std::sqrt(squares / static_cast<double>(lengths.size()));
  const auto [least, most] = std::ranges::minmax_element(lengths);
  solution.length_min_m = *least;
  solution.length_max_m = *most;
}

}  // namespace

std::vector<double> wand_lengths_m(const Bundle& bundle) {
  const int last = static_cast<int>(bundle.wand.marks_m.size()) - 1;
  std::vector<double> lengths;
  each_place(bundle, [&](std::span<const Sight> sights) {
    const auto first = point_of(bundle, sights, 0);
    const auto other = first ? point_of(bundle, sights, last) : std::nullopt;
    if (other) lengths.push_back((*other - *first).norm());
  });
  return lengths;
}

std::vector<double> measured_marks_m(const Bundle& bundle) {
  const std::size_t marks = bundle.wand.marks_m.size();
  std::vector<std::vector<double>> along(marks);
  each_place(bundle, [&](std::span<const Sight> sights) {
    std::vector<Vector3d> at;
    for (std::size_t m = 0; m < marks; ++m) {
      const auto point = point_of(bundle, sights, static_cast<int>(m));
      if (!point) return;
      at.push_back(*point);
    }
    const double length = (at.back() - at.front()).norm();
    for (std::size_t m = 0; m < marks; ++m)
      along[m].push_back((at[m] - at.front()).norm() / length * bundle.wand.length_m());
  });
  std::vector<double> measured;
  for (std::size_t m = 0; m < marks && !along[m].empty(); ++m) measured.push_back(median(along[m]));
  return measured;
}

WandSolution rate_wand(Bundle bundle, LensFreedom lens) {
  WandSolution solution;
  solution.bundle = std::move(bundle);
  const Bundle& solved = solution.bundle;
  std::vector<Sum> sums(solved.rig.size());
  std::vector<bool> used(solved.places.size(), false);
  double squares = 0.0;
  double weighted = 0.0;
  for (const Sight& sight : solved.sights) {
    add(solved, sight, sums[static_cast<std::size_t>(sight.camera)]);
    used[static_cast<std::size_t>(sight.place)] = true;
    const auto residual = solved.residual_px(sight);
    if (!residual) continue;
    squares += residual->squaredNorm();
    weighted += residual->squaredNorm() / (sight.sigma_px * sight.sigma_px);
  }
  solution.samples = static_cast<std::size_t>(std::ranges::count(used, true));
  const double rows = 2.0 * static_cast<double>(solved.sights.size());
  solution.rms_px = std::sqrt(squares / std::max(1.0, rows));
  const double unknowns =
      5.0 * static_cast<double>(solution.samples) + 6.0 * static_cast<double>(solved.rig.size() - 1);
  const double variance = weighted / std::max(1.0, rows - unknowns);

  RigDoubt doubt = doubt_of(solved, lens, variance);
  solution.cameras.resize(solved.rig.size());
  for (std::size_t c = 0; c < sums.size(); ++c) {
    CameraQuality& quality = solution.cameras[c];
    const Sum& sum = sums[c];
    quality.points = sum.points;
    if (sum.points > 0) quality.rms_px = std::sqrt(sum.squares / (2.0 * static_cast<double>(sum.points)));
    quality.coverage = static_cast<double>(std::ranges::count(sum.fields, true)) / (kFields * kFields);
    if (c < doubt.cameras.size()) quality.doubt = doubt.cameras[c];
  }
  solution.covariance = std::move(doubt.covariance);
  rate_length(solution);
  return solution;
}

}  // namespace mocap::calibration
