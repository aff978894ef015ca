#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "assemble.h"
#include "base/exit_codes.h"
#include "base/log.h"
#include "runtime/detection_report.h"
#include "runtime/pipeline.h"
#include "runtime/realtime.h"
#include "runtime/service.h"
#include "runtime/status_line.h"
#include "settings/daemon_settings.h"

namespace mocap {
namespace {

constexpr Duration kLookForSignals = std::chrono::milliseconds(100);
// Between two looks at the threads: every loop that sleeps has gone round by then.
constexpr Duration kLookAtProgress = std::chrono::milliseconds(500);
constexpr Duration kSayStatus = std::chrono::seconds(1);

// Before any thread starts, so that all inherit it: only the main loop takes these signals.
sigset_t block_end_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

bool asked_to_end_within(const sigset_t& signals, Duration patience) {
  const timespec limit{0, static_cast<long>(patience.count())};
  return sigtimedwait(&signals, nullptr, &limit) > 0;
}

// What the detectors say, camera by camera.
class Detectors {
 public:
  explicit Detectors(const settings::DaemonSettings& settings) {
    for (std::uint32_t i = 0; i < settings.cameras.size(); ++i) {
      const bool automatic = !settings::detect_of(settings, CameraId{i}).threshold.has_value();
      cameras_.push_back({"camera " + settings.cameras[i].name, runtime::DetectionReport(automatic)});
    }
  }

  void log(const runtime::Pipeline& pipeline, Timestamp now) {
    for (std::uint32_t i = 0; i < cameras_.size(); ++i) {
      auto& [who, report] = cameras_[i];
      for (const auto& line : report.look(runtime::detection_seen(pipeline, CameraId{i}), now)) {
        line.level == LogLevel::Warn ? log_warn(who, line.what) : log_info(who, line.what);
      }
    }
  }

 private:
  std::vector<std::pair<std::string, runtime::DetectionReport>> cameras_;
};

// Whether the cameras stand as the rig says; each change once.
class Stands {
 public:
  explicit Stands(const settings::DaemonSettings& settings) : drifted_(settings.cameras.size(), false) {
    for (const auto& camera : settings.cameras) names_.push_back("camera " + camera.name);
  }

  void log(const runtime::Pipeline& pipeline) {
    for (std::uint32_t i = 0; i < names_.size(); ++i) {
      const runtime::RigGauges& rig = pipeline.rig_gauges(CameraId{i});
      const bool drifted = rig.drifted.read() > 0.0;
      if (drifted == drifted_[i]) continue;
      drifted_[i] = drifted;
      if (!drifted) {
        log_info(names_[i], "stands as the rig says again");
        continue;
      }
      log_warn(
          names_[i],
          fmt::format("stands otherwise than the rig says: off={:.1f}px, as turned by {:.2f}deg and moved by "
                      "{:.0f}mm; was it bumped? See mocap-calibrate verify, and mend the rig with "
                      "mocap-calibrate refine",
                      rig.off_px.read(), rig.turned_rad.read() * 180.0 / std::numbers::pi, 1e3 * rig.moved_m.read()));
    }
  }

 private:
  std::vector<std::string> names_;
  std::vector<bool> drifted_;
};

void watch_over(runtime::Pipeline& pipeline, Detectors& detectors, Stands& stands, runtime::Service& service,
                const sigset_t& signals) {
  Timestamp looked_at = host_now();
  Timestamp said_at = looked_at;
  runtime::RunTotals said = runtime::totals_of(pipeline);
  while (!asked_to_end_within(signals, kLookForSignals) && !pipeline.finished()) {
    const Timestamp now = host_now();
    if (now - looked_at >= kLookAtProgress) {
      looked_at = now;
      if (pipeline.progressed()) service.alive();
    }
    if (now - said_at >= kSayStatus) {
      runtime::RunTotals totals = runtime::totals_of(pipeline);
      service.status(runtime::status_line(said, totals, now - said_at));
      detectors.log(pipeline, now);
      stands.log(pipeline);
      said = std::move(totals);
      said_at = now;
    }
  }
  stands.log(pipeline);
}

int exit_code_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::Busy:
    case ErrorCode::NotFound:
    case ErrorCode::Io:
    case ErrorCode::DeviceLost: return kExitUnavailable;
    case ErrorCode::InvalidArgument:
    case ErrorCode::Unsupported: return kExitConfig;
    default: return kExitSoftware;
  }
}

int serve(const settings::DaemonSettings& settings) {
  const sigset_t signals = block_end_signals();
  Result<Assembly> assembly = assemble(settings);
  if (!assembly) {
    log_error("mocapd", assembly.error().message);
    return exit_code_of(assembly.error().code);
  }
  if (settings.lock_memory) {
    const Status locked = runtime::lock_memory();
    if (!locked) log_warn("mocapd", locked.error().message);
  }
  runtime::Service service;
  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(assembly->parts));
  log_info("mocapd", fmt::format("started, cameras={} subjects={} feed={}", settings.cameras.size(),
                                 settings.subjects.size(), settings.publish.endpoint));
  service.ready(fmt::format("waiting for the images of {} cameras", pipeline.camera_count()));
  Detectors detectors(settings);
  Stands stands(settings);
  watch_over(pipeline, detectors, stands, service, signals);
  service.stopping();
  pipeline.stop();
  log_info("mocapd", "ended, " + runtime::summary_line(runtime::totals_of(pipeline)));
  return kExitOk;
}

// A line a fault, as compilers do, so that editors find the place. In the journal each is an error, sd-daemon(3).
void tell_faults(const settings::Faults& faults) {
  const bool journal = runtime::Service{}.logs_to_journal();
  std::istringstream lines(settings::to_text(faults));
  for (std::string line; std::getline(lines, line);) fmt::print(stderr, "{}{}\n", journal ? "<3>" : "", line);
}

// Makes each camera, which opens none, for what only its driver knows to be wrong.
settings::Faults driver_faults(const settings::DaemonSettings& settings, const std::filesystem::path& config) {
  settings::Faults faults{config, {}};
  for (std::uint32_t i = 0; i < settings.cameras.size(); ++i) {
    const Result<runtime::CameraParts> made = assemble_camera(settings, CameraId{i}, Timestamp{});
    if (!made) faults.list.push_back({config, 0, 0, made.error().message});
  }
  return faults;
}

int start(const std::filesystem::path& config, bool only_check) {
  Result<settings::DaemonSettings, settings::Faults> settings = settings::load_daemon_settings(config);
  settings::Faults faults = settings ? driver_faults(*settings, config) : settings.error();
  if (!faults.list.empty()) {
    tell_faults(faults);
    return kExitConfig;
  }
  if (only_check) {
    fmt::print("{}: good, cameras={} subjects={}\n", config.string(), settings->cameras.size(),
               settings->subjects.size());
    return kExitOk;
  }
  set_log_level(settings->log_level);
  set_log_for_journal(runtime::Service{}.logs_to_journal());
  log_info("mocapd", fmt::format("version {}, settings of {}", MOCAP_VERSION, config.string()));
  for (const auto& [key, value] : settings::list_settings(*settings)) log_debug("settings", key + " = " + value);
  return serve(*settings);
}

constexpr const char* kExamples = R"(examples:
  mocapd --config config/demo.toml          run with the simulated cameras of mocap-sim
  mocapd --config /etc/mocapd/mocapd.toml   run as the service does
  mocapd --check-config my.toml             say what is wrong with a configuration, change nothing

exit codes: 0 ended as asked, 64 wrong command line, 69 something needed is taken or missing (a port, a
folder), 70 a fault of ours, 78 wrong configuration)";

}  // namespace
}  // namespace mocap

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  CLI::App app{"mocapd: real-time optical motion capture; cameras in, labelled skeletons out over ZeroMQ", "mocapd"};
  app.footer(kExamples);
  std::string config;
  std::string check;
  auto* config_option = app.add_option("--config", config, "TOML file to run with")->type_name("FILE");
  auto* check_option = app.add_option("--check-config", check, "check this TOML file and exit (0 good, 78 faults)")
                           ->type_name("FILE")
                           ->excludes(config_option);
  app.set_version_flag("--version", "mocapd " MOCAP_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  }
  if (*check_option) return start(check, true);
  if (*config_option) return start(config, false);
  std::fputs("mocapd: nothing to do: give --config FILE, or see mocapd --help\n", stderr);
  return kExitUsage;
}
