#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "assemble.h"
#include "audit/audit_file.h"
#include "audit_changes.h"
#include "base/exit_codes.h"
#include "base/log.h"
#include "reload.h"
#include "run_log.h"
#include "runtime/audit_worker.h"
#include "runtime/pipeline.h"
#include "runtime/process/realtime.h"
#include "runtime/process/service.h"
#include "runtime/report/status_line.h"
#include "settings/daemon_settings.h"
#include "settings/example_config.h"
#include "settings/machine_checks.h"
#include "settings/same_settings.h"
#include "settings/state_folder.h"
#include "settings/subject/shape_checks.h"

namespace mocap {
namespace {

constexpr Duration kSignalPeriod = std::chrono::milliseconds(100);
// Period of the progress check: ten times the longest sleep of a loop.
constexpr Duration kProgressPeriod = std::chrono::milliseconds(500);
constexpr Duration kStatusPeriod = std::chrono::seconds(1);

enum class Signalled { Nothing, Reload, End };

// A write to a closed pipe, or beyond the limit of the size of files, fails instead of ending the daemon.
void ignore_write_signals() {
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
}

/// SIGTERM and SIGINT end the daemon. SIGHUP reloads the configuration, as is usual for daemons; it ends the daemon if
/// the terminal that the daemon was started from has closed.
class Signals {
 public:
  /// Blocks the signals in this thread and all later ones; the main loop waits for them. Construct before the first
  /// thread starts.
  Signals() : from_terminal_(::isatty(STDIN_FILENO) != 0) {
    sigemptyset(&blocked_);
    for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&blocked_, signal);
    pthread_sigmask(SIG_BLOCK, &blocked_, nullptr);
  }

  Signalled within(Duration patience) const {
    const timespec limit{0, static_cast<long>(patience.count())};
    const int signal = sigtimedwait(&blocked_, nullptr, &limit);
    if (signal <= 0) return Signalled::Nothing;
    const bool terminal_closed = from_terminal_ && ::isatty(STDIN_FILENO) == 0;
    return signal == SIGHUP && !terminal_closed ? Signalled::Reload : Signalled::End;
  }

 private:
  sigset_t blocked_{};
  bool from_terminal_;
};

// A request to change the configuration: by SIGHUP, or by an operator who waits for an answer.
struct ChangeRequest {
  runtime::MainOrder order;
  bool by_signal = false;
};

// Watches over a running pipeline: progress for the watchdog, status line, log. Returns nothing at the end of the run
// or after an end signal.
std::optional<ChangeRequest> run_until_asked(runtime::Pipeline& pipeline, RunLog& log, runtime::Service& service,
                                             const Signals& signals) {
  Timestamp progress_checked_at = host_now();
  Timestamp status_sent_at = progress_checked_at;
  runtime::RunTotals last_totals = runtime::totals_of(pipeline);
  while (!pipeline.finished()) {
    const Signalled signalled = signals.within(kSignalPeriod);
    if (signalled == Signalled::End) break;
    if (signalled == Signalled::Reload) return ChangeRequest{{}, true};
    if (std::optional<runtime::MainOrder> order = pipeline.take_order()) return ChangeRequest{*std::move(order), false};
    const Timestamp now = host_now();
    if (now - progress_checked_at >= kProgressPeriod) {
      progress_checked_at = now;
      if (pipeline.progressed()) service.alive();
    }
    if (now - status_sent_at >= kStatusPeriod) {
      runtime::RunTotals totals = runtime::totals_of(pipeline);
      service.status(runtime::status_line(last_totals, totals, now - status_sent_at));
      log.write(pipeline, now);
      last_totals = std::move(totals);
      status_sent_at = now;
    }
  }
  log.write_drift(pipeline);
  return std::nullopt;
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

// Makes the folders in the state folder that the configuration names for recordings.
void make_record_folders(const Configuration& configuration) {
  if (!configuration.state.exist()) return;
  const take::RecordSettings& record = configuration.settings->record;
  for (const std::filesystem::path& file : {record.snapshots, record.blobs}) {
    if (!configuration.state.has(file)) continue;
    std::error_code ignored;  // the recording reports a missing folder
    std::filesystem::create_directories(file.parent_path(), ignored);
  }
}

// Logs what an operator should know about the settings, and locks the memory if they say so.
void prepare(const settings::DaemonSettings& settings) {
  for (const std::string& warning : settings::shape_warnings(settings)) log_warn("mocapd", warning);
  for (const std::string& note : settings.state_notes) log_info("settings", note);
  if (!settings.record.snapshots.empty() || !settings.record.blobs.empty()) {
    log_warn("settings",
             "[record] works in this version for the last time; mocapctl take start records snapshots and "
             "blobs into one file, see [takes]");
  }
  if (!settings.pipeline.lock_memory) return;
  const Status locked = runtime::lock_memory();
  if (!locked) log_warn("mocapd", locked.error().message);
}

void log_change(const runtime::PipelineChange& change) {
  const auto count = [&](runtime::CameraStep step) {
    return std::ranges::count(change.cameras, step, &runtime::CameraChange::step);
  };
  const auto kept = std::ranges::count_if(change.handover.subjects, &SubjectId::names_something);
  log_info("mocapd",
           fmt::format("configuration changed, cameras: {} as before, {} with other processing, {} opened anew; "
                       "subjects: {} as before, {} new; {}",
                       count(runtime::CameraStep::Continue), count(runtime::CameraStep::Refresh),
                       count(runtime::CameraStep::Replace), kept, std::ssize(change.handover.subjects) - kept,
                       change.handover.poses ? "poses continue" : "the cameras moved, so only bodies are kept"));
}

enum class Outcome {
  Runs,      ///< with the new settings, or with those that it had
  Restarts,  ///< as must_restart
  Fails,     ///< a part could not be opened
};

// Whether nothing of the pipeline can continue: the run has another clock, or its node another port or other keys, or
// the clocks of nodes another source.
bool must_restart(const settings::DaemonSettings& before, const settings::DaemonSettings& now) {
  const bool is_node = before.node.on() || now.node.on();
  return is_replay(before) != is_replay(now) || !(before.ptp == now.ptp) ||
         (is_node && !(settings::same_section(before, now, "node") && settings::same_section(before, now, "security")));
}

std::vector<std::pair<std::string, std::string>> outcome_of(const runtime::MainDone& answer) {
  return {{"order", "reload"}, {"outcome", answer.done ? "done" : "invalid"}, {"answer", answer.message}};
}

// Notes each setting that changed, in the log before the change; then the log may be another one.
void note_changes(const settings::DaemonSettings& before, const settings::DaemonSettings& now, const AuditActor& who,
                  runtime::AuditWorker& audit) {
  for (AuditEntry& entry : audit_changes(before, now)) {
    entry.who = who;
    audit.note(std::move(entry));
  }
  if (!(before.audit == now.audit)) audit.change(audit::make_audit_writer(now.audit));
}

// Executes a request to change the configuration, and answers it.
Outcome change_running(runtime::Pipeline& pipeline, Configuration& configuration, const ChangeRequest& request,
                       SharedByCameras& shared, runtime::AuditWorker& audit) {
  runtime::MainDone answer;
  std::unique_ptr<settings::DaemonSettings> before;
  std::optional<runtime::PipelineChange> change;
  bool restarts = false;
  if (auto wanted = reload(configuration, request.order, answer)) {
    before = std::exchange(configuration.settings, std::move(wanted));
    restarts = must_restart(*before, *configuration.settings);
    make_record_folders(configuration);
    if (!restarts) {
      Result<runtime::PipelineChange> made =
          assemble_change(*before, *configuration.settings, pipeline, shared, &audit);
      if (made) {
        change = std::move(*made);
      } else {
        configuration.settings = std::move(before);
        answer.done = false;
        answer.message = made.error().message;
      }
    }
  }
  answer.change_follows = restarts || change.has_value();
  const AuditActor who = request.by_signal ? AuditActor{.name = "SIGHUP"} : request.order.by;
  if (request.by_signal) audit.note({.what = "ordered", .who = who, .details = outcome_of(answer)});
  if (restarts || change) note_changes(*before, *configuration.settings, who, audit);
  if (request.by_signal) {
    log_reload(answer);
  } else {
    pipeline.answer(std::move(answer));
  }
  if (restarts) return Outcome::Restarts;
  if (!change) return Outcome::Runs;
  set_log_level(configuration.settings->log_level);
  log_change(*change);
  prepare(*configuration.settings);
  const Status changed = pipeline.change(*std::move(change));
  if (!changed) log_error("mocapd", changed.error().message);
  return changed ? Outcome::Runs : Outcome::Fails;
}

// Runs one pipeline, through all changes of its configuration. Returns the exit code at the end of the run, or nothing
// if the pipeline must be constructed anew.
std::optional<int> serve_once(Configuration& configuration, runtime::Service& service, const Signals& signals,
                              runtime::AuditWorker& audit) {
  make_record_folders(configuration);
  Result<Assembly> assembly = assemble(*configuration.settings, &audit);
  if (!assembly) {
    log_error("mocapd", assembly.error().message);
    return exit_code_of(assembly.error().code);
  }
  prepare(*configuration.settings);
  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(assembly->parts));
  log_info("mocapd", fmt::format("started, cameras={} subjects={} feed={}", configuration.settings->cameras.size(),
                                 configuration.settings->subjects.size(), configuration.settings->publish.endpoint));
  service.ready(fmt::format("waiting for the images of {} cameras", pipeline.camera_count()));
  Outcome outcome = Outcome::Runs;
  RunLog log(*configuration.settings);
  while (outcome == Outcome::Runs) {
    const std::optional<ChangeRequest> request = run_until_asked(pipeline, log, service, signals);
    if (!request) break;
    outcome = change_running(pipeline, configuration, *request, *assembly->shared, audit);
    log = RunLog(*configuration.settings);
  }
  if (outcome != Outcome::Restarts) service.stopping();
  pipeline.stop();
  log_info("mocapd", (outcome == Outcome::Restarts ? "restarting, " : "ended, ") +
                         runtime::summary_line(runtime::totals_of(pipeline)));
  if (outcome == Outcome::Restarts) return std::nullopt;
  return outcome == Outcome::Fails ? kExitUnavailable : kExitOk;
}

int serve(Configuration configuration) {
  const Signals signals;
  ignore_write_signals();
  runtime::Service service;
  runtime::AuditWorker audit(audit::make_audit_writer(configuration.settings->audit));
  audit.note(
      {.what = "started", .details = {{"version", MOCAP_VERSION}, {"configuration", configuration.file.string()}}});
  for (;;) {
    const std::optional<int> exit = serve_once(configuration, service, signals, audit);
    if (!exit) continue;
    audit.note({.what = "ended", .details = {{"exit_code", std::to_string(*exit)}}});
    return *exit;
  }
}

// Prints one line for each fault in the format of compilers, so that editors find the place. The prefix <3> marks an
// error for the journal (sd-daemon(3)).
void print_faults(const settings::Faults& faults) {
  const bool journal = runtime::Service{}.logs_to_journal();
  std::istringstream lines(settings::to_text(faults));
  for (std::string line; std::getline(lines, line);) fmt::print(stderr, "{}{}\n", journal ? "<3>" : "", line);
}

int start(const std::filesystem::path& config, const settings::StateFiles& state, bool only_check) {
  Result<settings::DaemonSettings, settings::Faults> settings = load_checked(config, state);
  if (!settings) {
    print_faults(settings.error());
    return kExitConfig;
  }
  if (only_check) {
    if (const settings::Faults faults = settings::machine_faults(*settings, config, state); !faults.list.empty()) {
      print_faults(faults);
      return kExitConfig;
    }
    for (const std::string& warning : settings::shape_warnings(*settings))
      fmt::print(stderr, "{}: warning: {}\n", config.string(), warning);
    fmt::print("{}: good, cameras={} subjects={}\n", config.string(), settings->cameras.size(),
               settings->subjects.size());
    return kExitOk;
  }
  set_log_level(settings->log_level);
  set_log_for_journal(runtime::Service{}.logs_to_journal());
  log_info("mocapd", fmt::format("version {}, settings of {}{}", MOCAP_VERSION, config.string(),
                                 state.exist() ? ", state in " + state.folder.string() : ""));
  for (const auto& [key, value] : settings::list_settings(*settings)) log_debug("settings", key + " = " + value);
  Configuration configuration{config, state, std::make_unique<settings::DaemonSettings>(*std::move(settings))};
  return serve(std::move(configuration));
}

constexpr const char* kExamples = R"(examples:
  mocapd --config config/demo.toml
      run with the simulated cameras of mocap-sim
  mocapd --config /etc/mocapd/mocapd.toml
      run as the service does
  mocapd --check-config my.toml
      list all faults of a configuration and exit
  kill -HUP PID
      reload the configuration, as mocapctl reload does
  mocapd --example-config > my.toml
      write a configuration with every setting, its default, range and help

exit codes: 0 normal end, 64 wrong command line, 69 a resource is in use or
missing (a port, a folder), 70 internal error, 78 wrong configuration)";

}  // namespace
}  // namespace mocap

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  runtime::use_one_heap();
  CLI::App app{
      "mocapd: real-time optical motion capture; cameras in, labelled skeletons out\n"
      "over ZeroMQ",
      "mocapd"};
  app.footer(kExamples);
  std::string config;
  std::string check;
  std::string state;
  auto* config_option = app.add_option("--config", config, "TOML file to run with")->type_name("FILE");
  auto* check_option = app.add_option("--check-config", check, "check this TOML file and exit (0 good, 78 faults)")
                           ->type_name("FILE")
                           ->excludes(config_option);
  app.add_option("--state", state,
                 "folder of the files that the daemon writes; without it and $STATE_DIRECTORY: beside the TOML file")
      ->type_name("DIR");
  bool example = false;
  auto* example_option = app.add_flag("--example-config", example,
                                      "print a configuration with every setting and its\n"
                                      "default, and exit")
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
  const settings::StateFiles state_files =
      settings::state_files(state.empty() ? settings::state_folder_of_service() : std::filesystem::path(state));
  if (*check_option) return start(check, state_files, true);
  if (*config_option) return start(config, state_files, false);
  std::fputs("mocapd: nothing to do: give --config FILE, or see mocapd --help\n", stderr);
  return kExitUsage;
}
