#include "calibration/wand/solution_quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "calibration/image_cells.h"
#include "calibration/robust_statistics.h"
#include "calibration/sighting_of.h"
#include "geometry/lens.h"
#include "geometry/triangulation.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector3d;

struct CameraSum {
  double squares = 0.0;
  std::size_t points = 0;
  std::array<bool, kImageCells * kImageCells> cells{};
};

void add(const Bundle& bundle, const Observation& observation, CameraSum& sum) {
  const auto residual = bundle.residual_px(observation);
  if (!residual) return;
  const CameraModel& camera = bundle.rig[static_cast<std::size_t>(observation.camera)];
  sum.squares += residual->squaredNorm();
  ++sum.points;
  const auto cell = [](double at, int size) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>(at * kImageCells / size), 0, kImageCells - 1));
  };
  sum.cells[cell(observation.px.y(), camera.height_px) * kImageCells + cell(observation.px.x(), camera.width_px)] =
      true;
}

// The triangulated position of one marker; nothing if fewer than two cameras see it.
std::optional<Vector3d> triangulate_marker(const Bundle& bundle, std::span<const Observation> observations,
                                           int marker) {
  std::vector<geometry::Sighting> rays;
  for (const Observation& observation : observations) {
    if (observation.marker != marker) continue;
    const CameraModel& camera = bundle.rig[static_cast<std::size_t>(observation.camera)];
    const auto ray = geometry::undistort(camera.lens, {observation.px});
    if (!ray) continue;
    rays.push_back(sighting_of(camera, *ray, observation.sigma_px));
  }
  const auto start = geometry::triangulate(rays);
  if (!start) return std::nullopt;
  const auto refined = geometry::refine(rays, *start);
  if (!refined) return std::nullopt;
  return refined->point.v;
}

// Calls `visit` with the observations of each wand pose, which are consecutive.
void for_each_wand_pose(const Bundle& bundle, const auto& visit) {
  const std::span<const Observation> observations(bundle.observations);
  for (std::size_t from = 0; from < observations.size();) {
    std::size_t to = from;
    while (to < observations.size() && observations[to].wand_pose == observations[from].wand_pose) ++to;
    visit(observations.subspan(from, to - from));
    from = to;
  }
}

void assess_length(WandSolution& solution) {
  const std::vector<double> lengths = triangulated_lengths_m(solution.bundle);
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

std::vector<double> triangulated_lengths_m(const Bundle& bundle) {
  const int last = static_cast<int>(bundle.wand.marks_m.size()) - 1;
  std::vector<double> lengths;
  for_each_wand_pose(bundle, [&](std::span<const Observation> observations) {
    const auto first = triangulate_marker(bundle, observations, 0);
    const auto other = first ? triangulate_marker(bundle, observations, last) : std::nullopt;
    if (other) lengths.push_back((*other - *first).norm());
  });
  return lengths;
}

std::vector<double> triangulated_markers_m(const Bundle& bundle) {
  const std::size_t markers = bundle.wand.marks_m.size();
  std::vector<std::vector<double>> positions(markers);
  for_each_wand_pose(bundle, [&](std::span<const Observation> observations) {
    std::vector<Vector3d> at;
    for (std::size_t m = 0; m < markers; ++m) {
      const auto point = triangulate_marker(bundle, observations, static_cast<int>(m));
      if (!point) return;
      at.push_back(*point);
    }
    const double length = (at.back() - at.front()).norm();
    for (std::size_t m = 0; m < markers; ++m)
      positions[m].push_back((at[m] - at.front()).norm() / length * bundle.wand.length_m());
  });
  std::vector<double> medians;
  for (std::size_t m = 0; m < markers && !positions[m].empty(); ++m) medians.push_back(median(positions[m]));
  return medians;
}

WandSolution assess_solution(Bundle bundle, FreeIntrinsics free_intrinsics) {
  WandSolution solution;
  solution.bundle = std::move(bundle);
  const Bundle& solved = solution.bundle;
  std::vector<CameraSum> sums(solved.rig.size());
  std::vector<bool> used(solved.wand_poses.size(), false);
  double squares = 0.0;
  double weighted = 0.0;
  for (const Observation& observation : solved.observations) {
    add(solved, observation, sums[static_cast<std::size_t>(observation.camera)]);
    used[static_cast<std::size_t>(observation.wand_pose)] = true;
    const auto residual = solved.residual_px(observation);
    if (!residual) continue;
    squares += residual->squaredNorm();
    weighted += residual->squaredNorm() / (observation.sigma_px * observation.sigma_px);
  }
  solution.samples = static_cast<std::size_t>(std::ranges::count(used, true));
  const double rows = 2.0 * static_cast<double>(solved.observations.size());
  solution.rms_px = std::sqrt(squares / std::max(1.0, rows));
  const double unknowns =
      5.0 * static_cast<double>(solution.samples) + 6.0 * static_cast<double>(solved.rig.size() - 1);
  const double variance = weighted / std::max(1.0, rows - unknowns);

  RigCovariance covariance = rig_covariance(solved, free_intrinsics, variance);
  solution.cameras.resize(solved.rig.size());
  for (std::size_t c = 0; c < sums.size(); ++c) {
    CameraAccuracy& accuracy = solution.cameras[c];
    const CameraSum& sum = sums[c];
    accuracy.points = sum.points;
    if (sum.points > 0) accuracy.rms_px = std::sqrt(sum.squares / (2.0 * static_cast<double>(sum.points)));
    accuracy.coverage = static_cast<double>(std::ranges::count(sum.cells, true)) / (kImageCells * kImageCells);
    if (c < covariance.cameras.size()) accuracy.uncertainty = covariance.cameras[c];
  }
  solution.covariance = std::move(covariance.covariance);
  assess_length(solution);
  return solution;
}

}  // namespace mocap::calibration
