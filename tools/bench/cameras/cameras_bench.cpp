#include "bench/cameras/cameras_bench.h"

#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <utility>
#include <vector>

#include "assemble.h"
#include "base/log.h"
#include "bench/program.h"
#include "cameras/aravis/aravis_settings.h"
#include "cameras/own_network.h"
#include "cameras/v4l2/v4l2_settings.h"
#include "scene/ring_rig.h"
#include "settings/rig/rig_file.h"
#include "settings/subject/marker_set_file.h"
#include "support/temporary_folder.h"

namespace mocap::bench {
namespace {

constexpr double kExposure_us = 500.0;
constexpr int kLoopImages = 16;
constexpr double kAllStreamWithin_s = 20.0;

/// Accumulates the errors of the reported exposure times. The true exposure of the server ends at a whole period of
/// UTC, or starts there if action commands trigger it.
class TimeErrors {
 public:
  TimeErrors(double rate_hz, bool begin_with_period)
      : period_ns_(1000 * static_cast<std::int64_t>(1e6 / rate_hz)),
        middle_us_((begin_with_period ? 0.5 : -0.5) * kExposure_us) {}

  void see(const Snapshot& snapshot) {
    const std::int64_t offset_ns = utc_minus_host().count();
    for (const ViewStatus& view : snapshot.views) {
      const std::int64_t end_ns =
          to_ns(snapshot.instants.exposed_at + view.skew) + offset_ns - std::llround(1e3 * middle_us_);
      std::int64_t off_ns = end_ns % period_ns_;
      if (off_ns > period_ns_ / 2) off_ns -= period_ns_;
      const double off_us = 1e-3 * static_cast<double>(off_ns);
      const double skew_us = to_us(view.skew);
      sum_us_ += off_us;
      square_us2_ += off_us * off_us;
      apart_us2_ += skew_us * skew_us;
      ++count_;
    }
  }

  void report_errors(CamerasBenchFigures& figures) const {
    if (count_ == 0) return;
    const auto count = static_cast<double>(count_);
    figures.time_error_us = std::sqrt(square_us2_ / count);
    figures.time_offset_us = sum_us_ / count;
    figures.apart_us = std::sqrt(apart_us2_ / count);
  }

 private:
  std::int64_t period_ns_;
  double middle_us_;
  double sum_us_ = 0.0, square_us2_ = 0.0, apart_us2_ = 0.0;
  std::uint64_t count_ = 0;
};

class MeasuringPublisher : public Publisher {
 public:
  MeasuringPublisher(std::unique_ptr<Publisher> real, TimeErrors& errors, const std::atomic<bool>& measuring)
      : real_(std::move(real)), errors_(errors), measuring_(measuring) {}

  Status describe(const Description& description) override { return real_->describe(description); }
  Status report(const Health& health) override { return real_->report(health); }
  Status publish(Snapshot& snapshot) override {
    if (measuring_.load(std::memory_order_relaxed)) errors_.see(snapshot);
    return real_->publish(snapshot);
  }

 private:
  std::unique_ptr<Publisher> real_;
  TimeErrors& errors_;
  const std::atomic<bool>& measuring_;
};

/// CPU time of all threads of this process so far, by kind.
struct Used {
  double receive_s = 0.0, camera_s = 0.0, all_s = 0.0;
};

Used used_so_far() {
  Used used;
  std::error_code ignored;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", ignored)) {
    std::string name;
    std::uint64_t ns = 0;
    std::getline(std::ifstream(task.path() / "comm"), name);
    std::ifstream(task.path() / "schedstat") >> ns;
    const double s = 1e-9 * static_cast<double>(ns);
    used.all_s += s;
    if (name.starts_with("mocap-cam")) used.camera_s += s;
    if (name.starts_with("arv_gv_stream") || name.starts_with("arv_uv_stream")) used.receive_s += s;
  }
  return used;
}

struct Counted {
  std::uint64_t sets = 0, complete = 0, passed_over = 0, frames = 0, lost = 0, resent = 0, missing = 0;
};

Counted counted_so_far(const runtime::Pipeline& pipeline, const std::vector<const StreamCounters*>& streams) {
  Counted counted;
  counted.sets = pipeline.fusion_counters().sets.read();
  counted.complete = pipeline.fusion_counters().complete_sets.read();
  counted.passed_over = pipeline.fusion_counters().passed_over_sets.read();
  for (std::uint32_t i = 0; i < pipeline.camera_count(); ++i) {
    const runtime::CameraCounters& camera = pipeline.camera_counters(CameraId{i});
    counted.frames += camera.frames.read();
    // An incomplete image is also a gap in the frame numbers.
    counted.lost += std::max(camera.missing_frames.read(), camera.failed_frames.read());
    counted.lost += camera.dropped_queue_full.read();
    counted.resent += streams[i]->resent_packets.load(std::memory_order_relaxed);
    counted.missing += streams[i]->missing_packets.load(std::memory_order_relaxed);
  }
  return counted;
}

bool all_stream(const runtime::Pipeline& pipeline) {
  for (std::uint32_t i = 0; i < pipeline.camera_count(); ++i) {
    if (pipeline.camera_counters(CameraId{i}).frames.read() == 0) return false;
  }
  return true;
}

cameras::CameraSettings camera_of(const CamerasBenchSettings& wanted, int index) {
  const std::string name = fmt::format("cam{}", index + 1);
  if (wanted.bus == "v4l2") {
    cameras::V4l2Settings camera;
    camera.device = fmt::format("/dev/video{}", index);
    if (!wanted.pixel_format.empty()) camera.pixel_format = wanted.pixel_format;
    camera.width_px = wanted.width_px;
    camera.height_px = wanted.height_px;
    camera.rate_hz = wanted.rate_hz;
    return {name, camera};
  }
  cameras::AravisSettings camera;
  camera.address = fmt::format("127.0.0.{}", index + 2);
  if (!wanted.pixel_format.empty()) camera.pixel_format = wanted.pixel_format;
  camera.width_px = wanted.width_px;
  camera.height_px = wanted.height_px;
  camera.rate_hz = wanted.rate_hz;
  camera.exposure_us = kExposure_us;
  camera.packet_socket = false;
  camera.packet_size_bytes = wanted.packet_size_bytes;
  camera.clock = wanted.clock;
  camera.trigger = wanted.trigger;
  camera.ptp = wanted.ptp;
  return {name, camera};
}

settings::DaemonSettings daemon_of(const CamerasBenchSettings& wanted, const MarkerSet& marker_set) {
  settings::DaemonSettings settings;
  settings.rig = scene::ring_rig({.cameras = wanted.count, .width_px = wanted.width_px, .height_px = wanted.height_px});
  for (int i = 0; i < wanted.count; ++i) {
    settings.cameras.push_back(camera_of(wanted, i));
    settings.rig[static_cast<std::size_t>(i)].name = settings.cameras.back().name;
    settings.simulated.push_back(marker_set);
  }
  settings.subjects.push_back({.name = "subject", .marker_set_file = wanted.marker_set, .file = {}, .keep = {}});
  settings.subject_models.push_back({"subject", marker_set});
  settings.nominal_rate_hz = wanted.rate_hz;
  settings.pipeline.align.window = from_s(0.4 / wanted.rate_hz);
  if (wanted.patience_us > 0.0) settings.pipeline.align.patience = from_s(1e-6 * wanted.patience_us);
  settings.publish.endpoint = "tcp://127.0.0.1:*";
  return settings;
}

// Whether /dev/video0 is a v4l2loopback device, to which mocap-sim must write.
bool loops_back() {
  std::string name;
  std::getline(std::ifstream("/sys/class/video4linux/video0/name"), name);
  return name.starts_with("Dummy video device");
}

std::vector<std::string> loopback_arguments(const CamerasBenchSettings& wanted, const std::filesystem::path& rig) {
  std::vector<std::string> arguments{"--rig",         rig.string(),
                                     "--fps",         fmt::format("{}", wanted.rate_hz),
                                     "--v4l2-format", wanted.pixel_format.empty() ? "GREY" : wanted.pixel_format,
                                     "--v4l2"};
  for (int i = 0; i < wanted.count; ++i) arguments.push_back(fmt::format("/dev/video{}", i));
  return arguments;
}

std::vector<std::string> server_arguments(const CamerasBenchSettings& wanted, const std::filesystem::path& rig) {
  return {"--serve",
          "--rig",
          rig.string(),
          "--fps",
          fmt::format("{}", wanted.rate_hz),
          "--exposure-us",
          fmt::format("{}", kExposure_us),
          "--marker-set",
          wanted.marker_set.string(),
          "--loop-images",
          std::to_string(kLoopImages),
          "--clock-skew-us",
          fmt::format("{}", wanted.clock_skew_us),
          "--clock-drift-ppm",
          fmt::format("{}", wanted.clock_drift_ppm),
          "--delivery-jitter-us",
          fmt::format("{}", wanted.delivery_jitter_us),
          "--packet-loss",
          fmt::format("{}", wanted.packet_loss)};
}

Status wait_for_cameras(const runtime::Pipeline& pipeline) {
  WakeSignal nobody_calls;
  const Timestamp end = host_now() + from_s(kAllStreamWithin_s);
  while (!all_stream(pipeline)) {
    if (host_now() > end) return Error{ErrorCode::Timeout, "not all cameras stream after 20 s; see the lines above"};
    nobody_calls.wait(nobody_calls.ticket(), std::chrono::milliseconds(20));
  }
  return {};
}

CamerasBenchFigures figures_of(const CamerasBenchSettings& wanted, const Counted& before, const Counted& after,
                               const Used& used_before, const Used& used_after, double seconds) {
  CamerasBenchFigures figures;
  figures.sets = after.sets - before.sets;
  const double expected = std::max(static_cast<double>(figures.sets), std::floor(wanted.rate_hz * seconds) - 1.0);
  figures.complete_share = static_cast<double>(after.complete - before.complete) / expected;
  figures.passed_over = after.passed_over - before.passed_over;
  figures.frames = after.frames - before.frames;
  figures.lost = after.lost - before.lost;
  figures.frames_share =
      static_cast<double>(figures.frames) / std::max<double>(1.0, static_cast<double>(figures.frames + figures.lost));
  figures.resent_packets = after.resent - before.resent;
  figures.missing_packets = after.missing - before.missing;
  const double camera_seconds = seconds * wanted.count;
  figures.receive_cpu_share = (used_after.receive_s - used_before.receive_s) / camera_seconds;
  figures.detect_cpu_share = (used_after.camera_s - used_before.camera_s) / camera_seconds;
  figures.daemon_cpu_share = (used_after.all_s - used_before.all_s) / camera_seconds;
  return figures;
}

}  // namespace

Result<CamerasBenchFigures> run_cameras_bench(const CamerasBenchSettings& wanted) {
  set_log_level(LogLevel::Error);  // lost images are counted, not logged
  double load = 0.0;
  getloadavg(&load, 1);
  const bool served = wanted.bus == "gige";
  if (served) {
    const std::string refusal = cameras::enter_own_network(wanted.count);
    if (!refusal.empty()) return Error{ErrorCode::Unsupported, refusal};
  } else if (!std::filesystem::exists(fmt::format("/dev/video{}", wanted.count - 1))) {
    return Error{ErrorCode::Unsupported, fmt::format("no /dev/video{}; load vivid with n_devs={}, or v4l2loopback",
                                                     wanted.count - 1, wanted.count)};
  }
  const Result<MarkerSet> marker_set = settings::load_marker_set(wanted.marker_set);
  if (!marker_set) return marker_set.error();
  const settings::DaemonSettings daemon = daemon_of(wanted, *marker_set);
  const support::TemporaryFolder folder;
  const std::filesystem::path rig = folder.path() / "rig.toml";
  if (const Status saved = settings::save_rig(rig, daemon.rig, {}); !saved) return saved.error();
  std::optional<Program> server;
  if (served) server.emplace("mocap-sim", server_arguments(wanted, rig));
  if (!served && loops_back()) server.emplace("mocap-sim", loopback_arguments(wanted, rig));

  Result<Assembly> assembly = assemble(daemon);
  if (!assembly) return assembly.error();
  TimeErrors errors(wanted.rate_hz, wanted.trigger == "action");
  std::atomic<bool> measuring{false};
  assembly->parts.publisher =
      std::make_unique<MeasuringPublisher>(std::move(assembly->parts.publisher), errors, measuring);
  std::vector<const StreamCounters*> streams;
  for (const runtime::CameraParts& camera : assembly->parts.cameras) streams.push_back(camera.stream.get());
  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(assembly->parts));
  if (const Status streaming = wait_for_cameras(pipeline); !streaming) return streaming.error();

  WakeSignal nobody_calls;
  nobody_calls.wait(nobody_calls.ticket(), from_s(wanted.warm_up_s));
  const Counted before = counted_so_far(pipeline, streams);
  const Used used_before = used_so_far();
  const Timestamp began = host_now();
  measuring = true;
  nobody_calls.wait(nobody_calls.ticket(), from_s(wanted.seconds));
  measuring = false;
  const double seconds = to_s(host_now() - began);
  CamerasBenchFigures figures =
      figures_of(wanted, before, counted_so_far(pipeline, streams), used_before, used_so_far(), seconds);
  pipeline.stop();
  figures.load = load;
  if (served) errors.report_errors(figures);
  return figures;
}

}  // namespace mocap::bench
