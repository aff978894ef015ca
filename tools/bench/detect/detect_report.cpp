#include "bench/detect/detect_report.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/exit_codes.h"

namespace mocap::bench {
namespace {

nlohmann::json json_of(const DetectRadiusFigures& f) {
  return {{"radius_px", f.radius_px},
          {"blobs", f.blobs},
          {"centroid_rms_px", f.centroid_rms_px},
          {"crlb_px", f.crlb_px},
          {"sigma_px", f.sigma_px}};
}

void print_json(const DetectBenchFigures& f) {
  nlohmann::json object{{"median_us", f.median_us},
                        {"ratio_read", f.ratio_read},
                        {"speedup_opencv", f.speedup_opencv},
                        {"centroid_rms_px", f.all.centroid_rms_px},
                        {"crlb_px", f.all.crlb_px},
                        {"sigma_px", f.all.sigma_px},
                        {"recall", f.recall},
                        {"false_per_frame", f.false_per_frame},
                        {"isa", f.isa},
                        {"read_us", f.read_us},
                        {"opencv_us", f.opencv_us},
                        {"white_noise_us", f.white_noise_us},
                        {"ratio_white_noise", f.ratio_white_noise}};
  for (const DetectRadiusFigures& each : f.by_radius) object["by_radius"].push_back(json_of(each));
  fmt::print("{}\n", object.dump());
}

void print_table(const DetectBenchFigures& f) {
  fmt::print("an image        {:8.1f} us   {} \n", f.median_us, f.isa);
  fmt::print("its plain read  {:8.1f} us   {:.2f} x\n", f.read_us, f.ratio_read);
  fmt::print("OpenCV          {:8.1f} us   {:.1f} x as long\n", f.opencv_us, f.speedup_opencv);
  fmt::print("white noise     {:8.1f} us   {:.1f} x a dark image\n", f.white_noise_us, f.ratio_white_noise);
  fmt::print("found           {:8.2f} %    {:.2f} false an image\n\n", 100.0 * f.recall, f.false_per_frame);
  fmt::print("radius px   blobs   rms px    bound px   rms/bound   predicted/rms\n");
  const auto line = [](const std::string& name, const DetectRadiusFigures& each) {
    if (each.blobs == 0) return;
    fmt::print("{:<9} {:7}   {:.5f}   {:.5f}   {:9.3f}   {:13.3f}\n", name, each.blobs, each.centroid_rms_px,
               each.crlb_px, each.centroid_rms_px / each.crlb_px, each.sigma_px / each.centroid_rms_px);
  };
  for (const DetectRadiusFigures& each : f.by_radius)
    line(fmt::format("{:.0f} to {:.0f}", each.radius_px, each.radius_px + 1.0), each);
  line("all", f.all);
}

}  // namespace

int detect(const simworld::DetectSceneSettings& settings, bool json) {
  const Result<DetectBenchFigures> figures = run_detect_bench(settings);
  if (!figures) {
    fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
    return kExitUnavailable;
  }
  if (json) {
    print_json(*figures);
  } else {
    print_table(*figures);
  }
  return kExitOk;
}

}  // namespace mocap::bench
