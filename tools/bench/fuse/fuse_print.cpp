#include "bench/fuse/fuse_print.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

namespace mocap::bench {
namespace {

nlohmann::json object_of(const FuseBenchFigures& f) {
  return {{"mode", f.mode},
          {"cameras", f.cameras},
          {"markers", f.markers},
          {"median_us", f.median_us},
          {"p99_us", f.p99_us},
          {"max_us", f.max_us},
          {"median_cpu_us", f.median_cpu_us},
          {"p99_cpu_us", f.p99_cpu_us},
          {"align_us", f.align_us},
          {"match_us", f.match_us},
          {"triangulate_us", f.triangulate_us},
          {"track_us", f.track_us},
          {"opencv_us", f.opencv_us},
          {"speedup_opencv", f.speedup_opencv},
          {"blobs", f.blobs},
          {"ns_per_blob", f.ns_per_blob},
          {"recall", f.recall},
          {"ghosts_per_1000", f.ghosts_per_1000},
          {"rms_mm", f.rms_mm},
          {"skipped", f.skipped}};
}

std::string power(std::span<const FuseBenchFigures> figures, std::string_view mode, std::string_view over) {
  const auto exponent = growth_exponent(figures, mode);
  return exponent ? fmt::format(", {} blobs^{:.2f}", over, *exponent) : std::string{};
}

// The growth of the cost in one mode: over all sizes, with the markers only, and with the cameras only.
std::string growth_line(std::span<const FuseBenchFigures> figures, std::string_view mode) {
  if (!growth_exponent(figures, mode)) return {};
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  std::map<int, std::vector<FuseBenchFigures>> by_cameras, by_markers;
  for (const FuseBenchFigures& f : figures) {
    if (f.mode != mode) continue;
    least = std::min(least, f.ns_per_blob);
    most = std::max(most, f.ns_per_blob);
    by_cameras[f.cameras].push_back(f);
    by_markers[f.markers].push_back(f);
  }
  std::string text = fmt::format("{:<9} {:.0f} to {:.0f} ns a blob; grows as", mode, least, most);
  text += power(figures, mode, "over all sizes").substr(1);
  for (const auto& [cameras, of] : by_cameras) text += power(of, mode, fmt::format("of {} cameras", cameras));
  for (const auto& [markers, of] : by_markers) text += power(of, mode, fmt::format("of {} markers", markers));
  return text + "\n";
}

}  // namespace

std::optional<double> growth_exponent(std::span<const FuseBenchFigures> figures, std::string_view mode) {
  constexpr std::size_t kLeastSizes = 3;
  std::vector<std::pair<double, double>> at;
  std::vector<double> sizes;
  for (const FuseBenchFigures& f : figures) {
    if (f.mode != mode || !(f.blobs > 0.0) || !(f.median_us > 0.0)) continue;
    at.emplace_back(std::log(f.blobs), std::log(f.median_us));
    if (std::ranges::find(sizes, f.blobs) == sizes.end()) sizes.push_back(f.blobs);
  }
  if (sizes.size() < kLeastSizes) return std::nullopt;
  double mean_x = 0.0, mean_y = 0.0;
  for (const auto& [x, y] : at) {
    mean_x += x / static_cast<double>(at.size());
    mean_y += y / static_cast<double>(at.size());
  }
  double xx = 0.0, xy = 0.0;
  for (const auto& [x, y] : at) {
    xx += (x - mean_x) * (x - mean_x);
    xy += (x - mean_x) * (y - mean_y);
  }
  return xy / xx;
}

std::string fuse_json(std::span<const FuseBenchFigures> figures) {
  nlohmann::json all = nlohmann::json::array();
  for (const FuseBenchFigures& f : figures) {
    all.push_back(object_of(f));
    if (const auto exponent = growth_exponent(figures, f.mode)) all.back()["growth_exponent"] = *exponent;
  }
  return all.dump();
}

std::string fuse_table(std::span<const FuseBenchFigures> figures) {
  std::string text = fmt::format(
      "{:<9} {:>4} {:>4} {:>7} | {:>8} {:>8} {:>8} {:>8} {:>8} | {:>6} {:>7} {:>7} {:>7} | {:>8} {:>6} | {:>7} {:>6} "
      "{:>6} "
      "{:>6}\n",
      "mode", "cams", "mkrs", "blobs", "median", "p99", "max", "med cpu", "p99 cpu", "align", "match", "triang",
      "track", "opencv", "times", "ns/blob", "recall", "ghosts", "rms mm");
  for (const FuseBenchFigures& f : figures) {
    text += fmt::format(
        "{:<9} {:>4} {:>4} {:>7.0f} | {:>8.1f} {:>8.1f} {:>8.1f} {:>8.1f} {:>8.1f} | {:>6.1f} {:>7.1f} {:>7.1f} "
        "{:>7.1f} | "
        "{:>8.0f} {:>6.1f} | {:>7.0f} {:>6.4f} {:>6.1f} {:>6.3f}\n",
        f.mode, f.cameras, f.markers, f.blobs, f.median_us, f.p99_us, f.max_us, f.median_cpu_us, f.p99_cpu_us,
        f.align_us, f.match_us, f.triangulate_us, f.track_us, f.opencv_us, f.speedup_opencv, f.ns_per_blob, f.recall,
        f.ghosts_per_1000, f.rms_mm);
  }
  for (const std::string_view mode : {"predicted", "cold"}) text += growth_line(figures, mode);
  return text;
}

}  // namespace mocap::bench
