#include "fuse_print.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

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

}  // namespace

std::string fuse_json(std::span<const FuseBenchFigures> figures) {
  nlohmann::json all = nlohmann::json::array();
  for (const FuseBenchFigures& f : figures) all.push_back(object_of(f));
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
  return text;
}

}  // namespace mocap::bench
