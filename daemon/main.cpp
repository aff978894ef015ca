#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
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
#include "settings/add_subject.h"
#include "settings/daemon_settings.h"
#include "settings/example_config.h"
#include "settings/learnt_masks.h"
#include "settings/shape_checks.h"

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

// Makes each camera, which opens none, for what only its driver knows to be wrong.
settings::Faults driver_faults(const settings::DaemonSettings& settings, const std::filesystem::path& config) {
  settings::Faults faults{config, {}};
  for (std::uint32_t i = 0; i < settings.cameras.size(); ++i) {
    const Result<runtime::CameraParts> made = assemble_camera(settings, CameraId{i}, Timestamp{});
    if (!made) faults.list.push_back({config, 0, 0, made.error().message});
  }
  return faults;
}

Result<settings::DaemonSettings, settings::Faults> load_checked(const std::filesystem::path& config) {
  Result<settings::DaemonSettings, settings::Faults> settings = settings::load_daemon_settings(config);
  if (!settings) return settings;
  settings::Faults faults = driver_faults(*settings, config);
  if (!faults.list.empty()) return faults;
  return settings;
}

/// What the daemon runs with, and where that is from.
struct Configuration {
  std::filesystem::path file;
  std::unique_ptr<settings::DaemonSettings> settings;
};

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

// What the operator's order comes to: the configuration is read anew, after what was learnt is kept. The answer goes
// to the operator. Gives the settings to start anew with; none: all goes on as it was.
std::unique_ptr<settings::DaemonSettings> reload(const std::filesystem::path& config,
                                                 const settings::DaemonSettings& now, runtime::MainOrder& order,
                                                 runtime::MainDone& answer) {
  answer.order = order.number;
  if (!order.masks.empty()) {
    Rig rig = now.rig;
    for (std::size_t i = 0; i < rig.size(); ++i) rig[i].learnt_masks = order.masks[i];
    const Status kept = settings::save_learnt_masks(now.capture.rig_file, rig);
    if (!kept) {
      answer.message = kept.error().message;
      return nullptr;
    }
  }
  if (!order.subject.empty()) {
    const settings::NewSubject subject{order.subject, order.marker_set};
    const auto check = [](const std::filesystem::path& file) {
      const auto good = load_checked(file);
      return good ? settings::Faults{} : good.error();
    };
    const Status added = settings::add_subject(config, subject, check);
    if (!added) {
      answer.message = added.error().message;
      return nullptr;
    }
  }
  Result<settings::DaemonSettings, settings::Faults> read = load_checked(config);
  if (!read) {
    answer.message = settings::to_text(read.error());
    return nullptr;
  }
  answer.done = true;
  answer.message = config.string() + " is good; the daemon starts anew with it";
  return std::make_unique<settings::DaemonSettings>(*std::move(read));
}

// Until the end, or until there are new settings to start anew with.
std::unique_ptr<settings::DaemonSettings> watch_over(runtime::Pipeline& pipeline, Detectors& detectors, Stands& stands,
                                                     runtime::Service& service, const sigset_t& signals,
                                                     const Configuration& configuration) {
  Timestamp looked_at = host_now();
  Timestamp said_at = looked_at;
  runtime::RunTotals said = runtime::totals_of(pipeline);
  while (!asked_to_end_within(signals, kLookForSignals) && !pipeline.finished()) {
    if (std::optional<runtime::MainOrder> order = pipeline.take_order()) {
      runtime::MainDone answer;
      auto anew = reload(configuration.file, *configuration.settings, *order, answer);
      pipeline.answer(std::move(answer));
      if (anew != nullptr) return anew;
    }
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
  return nullptr;
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

// One life of the pipeline: until the end, or until there are new settings in `configuration` (then nothing).
std::optional<int> serve_once(Configuration& configuration, runtime::Service& service, const sigset_t& signals) {
  const settings::DaemonSettings& settings = *configuration.settings;
  Result<Assembly> assembly = assemble(settings);
  if (!assembly) {
    log_error("mocapd", assembly.error().message);
    return exit_code_of(assembly.error().code);
  }
  for (const std::string& warning : settings::shape_warnings(settings)) log_warn("mocapd", warning);
  if (settings.pipeline.lock_memory) {
    const Status locked = runtime::lock_memory();
    if (!locked) log_warn("mocapd", locked.error().message);
  }
  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(assembly->parts));
  log_info("mocapd", fmt::format("started, cameras={} subjects={} feed={}", settings.cameras.size(),
                                 settings.subjects.size(), settings.publish.endpoint));
  service.ready(fmt::format("waiting for the images of {} cameras", pipeline.camera_count()));
  Detectors detectors(settings);
  Stands stands(settings);
  std::unique_ptr<settings::DaemonSettings> anew =
      watch_over(pipeline, detectors, stands, service, signals, configuration);
  if (anew == nullptr) service.stopping();
  pipeline.stop();
  log_info("mocapd", (anew ? "starts anew, " : "ended, ") + runtime::summary_line(runtime::totals_of(pipeline)));
  if (anew == nullptr) return kExitOk;
  configuration.settings = std::move(anew);
  return std::nullopt;
}

int serve(Configuration configuration) {
  const sigset_t signals = block_end_signals();
  runtime::Service service;
  for (;;) {
    if (const std::optional<int> exit = serve_once(configuration, service, signals)) return *exit;
  }
}

// A line a fault, as compilers do, so that editors find the place. In the journal each is an error, sd-daemon(3).
void tell_faults(const settings::Faults& faults) {
  const bool journal = runtime::Service{}.logs_to_journal();
  std::istringstream lines(settings::to_text(faults));
  for (std::string line; std::getline(lines, line);) fmt::print(stderr, "{}{}\n", journal ? "<3>" : "", line);
}

int start(const std::filesystem::path& config, bool only_check) {
  Result<settings::DaemonSettings, settings::Faults> settings = load_checked(config);
  if (!settings) {
    tell_faults(settings.error());
    return kExitConfig;
  }
  if (only_check) {
    for (const std::string& warning : settings::shape_warnings(*settings))
      fmt::print(stderr, "{}: warning: {}\n", config.string(), warning);
    fmt::print("{}: good, cameras={} subjects={}\n", config.string(), settings->cameras.size(),
               settings->subjects.size());
    return kExitOk;
  }
  set_log_level(settings->log_level);
  set_log_for_journal(runtime::Service{}.logs_to_journal());
  log_info("mocapd", fmt::format("version {}, settings of {}", MOCAP_VERSION, config.string()));
  for (const auto& [key, value] : settings::list_settings(*settings)) log_debug("settings", key + " = " + value);
  Configuration configuration{config, std::make_unique<settings::DaemonSettings>(*std::move(settings))};
  return serve(std::move(configuration));
}

constexpr const char* kExamples = R"(examples:
  mocapd --config config/demo.toml          run with the simulated cameras of mocap-sim
  mocapd --config /etc/mocapd/mocapd.toml   run as the service does
  mocapd --check-config my.toml             list all faults of a configuration and exit
  mocapd --example-config > my.toml         write a configuration with every setting, its default, range and help

exit codes: 0 ended as asked, 64 wrong command line, 69 something needed is taken or missing (a port, a
folder), 70 a fault of ours, 78 wrong configuration)";

}  // namespace
}  // namespace mocap

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  runtime::use_one_heap();
  CLI::App app{"mocapd: real-time optical motion capture; cameras in, labelled skeletons out over ZeroMQ", "mocapd"};
  app.footer(kExamples);
  std::string config;
  std::string check;
  auto* config_option = app.add_option("--config", config, "TOML file to run with")->type_name("FILE");
  auto* check_option = app.add_option("--check-config", check, "check this TOML file and exit (0 good, 78 faults)")
                           ->type_name("FILE")
                           ->excludes(config_option);
  bool example = false;
  auto* example_option =
      app.add_flag("--example-config", example, "print a configuration with every setting and its default, and exit")
          ->excludes(config_option)
          ->excludes(check_option);
  app.set_version_flag("--version", "mocapd " MOCAP_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  }
  if (*example_option) {
    fmt::print("{}", settings::example_config());
    return kExitOk;
  }
  if (*check_option) return start(check, true);
  if (*config_option) return start(config, false);
  std::fputs("mocapd: nothing to do: give --config FILE, or see mocapd --help\n", stderr);
  return kExitUsage;
}
