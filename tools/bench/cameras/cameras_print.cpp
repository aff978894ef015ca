#include "bench/cameras/cameras_print.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/exit_codes.h"

namespace mocap::bench {
namespace {

nlohmann::json number_or_null(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

std::string text_of(const std::optional<double>& value) { return value ? fmt::format("{:.1f} us", *value) : "unknown"; }

}  // namespace

void add_cameras_options(cli::App& command, CamerasBenchSettings& settings) {
  command
      .add_option("--bus", settings.bus,
                  "gige: served by mocap-sim on loopback; v4l2: /dev/video0, /dev/video1, ... (vivid, v4l2loopback fed "
                  "by mocap-sim, or real cameras)")
      ->check(cli::IsMember({"gige", "v4l2"}))
      ->capture_default_str();
  command.add_option("--count", settings.count, "cameras")->check(cli::Range(1, 64))->capture_default_str();
  command
      .add_option(
          "--size",
          [&settings](const std::string& size) -> std::optional<std::string> {
            int end = 0;
            const int read = std::sscanf(size.c_str(), "%dx%d%n", &settings.width_px, &settings.height_px, &end);
            if (read != 2 || static_cast<std::size_t>(end) != size.size() || settings.width_px < 16 ||
                settings.height_px < 16) {
              return size + ", expected WxH";
            }
            return std::nullopt;
          },
          "image size, px, such as 640x480 (the default)")
      ->type_name("WxH");
  command.add_option("--rate", settings.rate_hz, "frame rate, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  command.add_option("--seconds", settings.seconds, "measured time, s")
      ->check(cli::Range(0.5, 3600.0))
      ->capture_default_str();
  command
      .add_option("--warm-up", settings.warm_up_s, "time between the first image of all cameras and the measurement, s")
      ->check(cli::Range(0.0, 600.0))
      ->capture_default_str();
  command.add_option("--format", settings.pixel_format, "pixel format; default: Mono8, GREY");
  command.add_option("--clock", settings.clock, "estimated or utc")
      ->check(cli::IsMember({"estimated", "utc"}))
      ->capture_default_str();
  command
      .add_option("--trigger", settings.trigger, "free_run, or action: exposures triggered by action commands (gige)")
      ->check(cli::IsMember({"free_run", "action"}))
      ->capture_default_str();
  command.add_flag("--ptp", settings.ptp, "camera clocks follow PTP (gige)");
  command.add_option("--clock-skew-us", settings.clock_skew_us, "offset of the camera clocks (gige)");
  command.add_option("--clock-drift-ppm", settings.clock_drift_ppm, "drift of the camera clocks (gige)");
  command.add_option("--delivery-jitter-us", settings.delivery_jitter_us, "mean delay of an image (gige)");
  command.add_option("--packet-loss", settings.packet_loss, "share of the packets that are lost (gige)");
  command.add_option("--packet-size", settings.packet_size_bytes, "bytes (gige)")
      ->check(cli::Range(576, 65507))
      ->capture_default_str();
  command.add_option("--patience-us", settings.patience_us,
                     "how long a set waits for its last image; 0: default of the daemon");
}

int cameras(const CamerasBenchSettings& settings, bool json) {
  const Result<CamerasBenchFigures> figures = run_cameras_bench(settings);
  if (!figures) {
    fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
    return kExitUnavailable;
  }
  const CamerasBenchFigures& f = *figures;
  if (json) {
    const nlohmann::json object{{"sets", f.sets},
                                {"complete_share", f.complete_share},
                                {"passed_over", f.passed_over},
                                {"frames", f.frames},
                                {"lost", f.lost},
                                {"frames_share", f.frames_share},
                                {"resent_packets", f.resent_packets},
                                {"missing_packets", f.missing_packets},
                                {"receive_cpu_share", f.receive_cpu_share},
                                {"detect_cpu_share", f.detect_cpu_share},
                                {"daemon_cpu_share", f.daemon_cpu_share},
                                {"load_before", f.load},
                                {"time_error_us", number_or_null(f.time_error_us)},
                                {"time_offset_us", number_or_null(f.time_offset_us)},
                                {"apart_us", number_or_null(f.apart_us)}};
    fmt::print("{}\n", object.dump());
    return kExitOk;
  }
  fmt::print(
      "sets           {}, {} skipped for a newer set\ncomplete       {:.2f} %\nimages         {}, lost {} ({:.3f} "
      "% came)\n",
      f.sets, f.passed_over, 100.0 * f.complete_share, f.frames, f.lost, 100.0 * f.frames_share);
  fmt::print("packets        {} resent, {} missing\n", f.resent_packets, f.missing_packets);
  fmt::print("a camera costs {:.1f} % of a processor to receive, {:.1f} % to detect and track, {:.1f} % in all\n",
             100.0 * f.receive_cpu_share, 100.0 * f.detect_cpu_share, 100.0 * f.daemon_cpu_share);
  fmt::print("exposure time  error {} rms (mean {}), between cameras {} rms\nload before    {:.1f}\n",
             text_of(f.time_error_us), text_of(f.time_offset_us), text_of(f.apart_us), f.load);
  return kExitOk;
}

}  // namespace mocap::bench
