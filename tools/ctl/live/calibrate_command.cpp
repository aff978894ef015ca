#include "ctl/live/calibrate_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <numbers>
#include <thread>

#include "base/exit_codes.h"
#include "base/time.h"
#include "calibration/wand/parse_wand.h"
#include "ctl/live/live_answer.h"
#include "ctl/live/live_connection.h"
#include "lib/cli/status_line.h"

namespace mocap::ctl {
namespace {

constexpr Duration kAskPeriod = std::chrono::milliseconds(500);
constexpr double kPrintPeriod_s = 5.0;  // without a terminal
volatile std::sig_atomic_t interrupted = 0;

int fail_calibration(const LiveFailure& failure) {
  fmt::print(stderr, "mocapctl: {}\n", failure.message);
  return failure.exit;
}

// Shows the progress of a calibration; without a terminal a line every 5 s.
class CalibrationLine {
 public:
  void show(const std::string& line) {
    if (on_terminal_.on_terminal()) return on_terminal_.show(line);
    if (host_now() < print_at_) return;
    print_at_ = host_now() + from_s(kPrintPeriod_s);
    fmt::print(stderr, "{}\n", line);
  }
  void clear() { on_terminal_.clear(); }

 private:
  cli::StatusLine on_terminal_;
  Timestamp print_at_;
};

std::string collection_line(const v1::Calibration& progress, double seconds) {
  std::string cameras;
  for (const v1::CalibrationCamera& camera : progress.cameras()) {
    cameras += fmt::format("{}{} {}/{:.0f}%", cameras.empty() ? "" : ", ", camera.name(), camera.shared(),
                           100.0 * camera.coverage());
  }
  return fmt::format("{:.0f} s: {}; {}", seconds, cameras, progress.complete() ? "complete" : progress.advice());
}

/// One calibration, from the order in the options to its result.
class CalibrationRun {
 public:
  CalibrationRun(wire::ControlClient& client, const LiveOptions& options) : client_(client), options_(options) {}

  Result<v1::Calibration, LiveFailure> run() {
    auto progress = order(options_.request.calibration.action);
    const Timestamp begun = host_now();
    while (progress && progress->state() == v1::CALIBRATION_STATE_COLLECTING) {
      const double seconds = to_s(host_now() - begun);
      line_.show(progress->floor() ? progress->advice() : collection_line(*progress, seconds));
      progress = order(next_after(*progress, seconds));
    }
    while (progress && progress->state() == v1::CALIBRATION_STATE_SOLVING) {
      line_.show(fmt::format("{} {:.0f} %", progress->step(), 100.0 * progress->fraction()));
      if (interrupted > 1) static_cast<void>(order(CalibrationAction::Cancel));
      std::this_thread::sleep_for(kAskPeriod);
      progress = order(CalibrationAction::Look);
    }
    line_.clear();
    if (progress && progress->state() != v1::CALIBRATION_STATE_SOLVED) {
      return LiveFailure{kExitData, progress->message()};
    }
    return progress;
  }

 private:
  // The daemon itself ends the measurement of the floor.
  CalibrationAction next_after(const v1::Calibration& progress, double seconds) {
    if (progress.floor() && interrupted != 0) return CalibrationAction::Cancel;
    if (!progress.floor() && (progress.complete() || interrupted != 0 || seconds >= options_.seconds)) {
      return CalibrationAction::Solve;
    }
    std::this_thread::sleep_for(kAskPeriod);
    return CalibrationAction::Look;
  }

  Result<v1::Calibration, LiveFailure> order(CalibrationAction action) {
    ControlRequest request = options_.request;
    const bool looks = action == CalibrationAction::Look;
    request.action = looks ? ControlAction::GetCalibration : ControlAction::Calibrate;
    request.calibration.action = action;
    const auto answer = ask_once(client_, request, options_.timeout_s);
    if (!answer) return answer.error();
    if (answer->code() != v1::CODE_DONE) return LiveFailure{exit_code_of(answer->code()), answer->message()};
    return answer->calibration();
  }

  wire::ControlClient& client_;
  const LiveOptions& options_;
  CalibrationLine line_;
};

// Runs the calibration in the options and, without --dry-run, applies the result.
int calibrate(const LiveOptions& options, const char* what_to_do) {
  auto client = connect(options);
  if (!client) return fail_calibration(client.error());
  std::signal(SIGINT, [](int) { interrupted = interrupted + 1; });
  fmt::print(stderr, "mocapctl: {}\n", what_to_do);
  const auto solved = CalibrationRun(**client, options).run();
  if (!solved) return fail_calibration(solved.error());
  v1::Answer shown;
  shown.set_code(v1::CODE_DONE);
  *shown.mutable_calibration() = *solved;
  print_answer(shown, options.json, false);
  if (options.dry_run) return kExitOk;
  ControlRequest apply;
  apply.action = ControlAction::Calibrate;
  apply.calibration.action = CalibrationAction::Apply;
  const auto applied = ask_once(**client, apply, options.timeout_s);
  if (!applied) return fail_calibration(applied.error());
  fmt::print(stderr, "mocapctl: {}\n", applied->message());
  return exit_code_of(applied->code());
}

int calibrate_with_wand(LiveOptions& options) {
  const auto wand = calibration::parse_wand(options.wand);
  if (!wand) return fail_calibration({kExitUsage, wand.error().message});
  options.request.calibration.action = CalibrationAction::Wand;
  options.request.calibration.wand_m = wand->marks_m;
  return calibrate(options,
                   "wave the wand through the whole volume in all directions; ends when complete, or with Ctrl-C");
}

int measure_floor(LiveOptions& options) {
  options.request.calibration.action = CalibrationAction::Floor;
  options.request.calibration.floor = cli::floor_order(options.floor);
  return calibrate(options, options.floor.by_walk ? "walk through the whole volume for 30 s"
                                                  : "leave the markers on the floor still for 5 s");
}

int order_calibration(LiveOptions& options, CalibrationAction action) {
  ControlRequest& request = options.request;
  const bool looks = action == CalibrationAction::Look || action == CalibrationAction::List;
  request.action = looks ? ControlAction::GetCalibration : ControlAction::Calibrate;
  request.calibration.action = action;
  auto client = connect(options);
  if (!client) return fail_calibration(client.error());
  const auto answer = ask_once(**client, request, options.timeout_s);
  if (!answer) return fail_calibration(answer.error());
  print_answer(*answer, options.json, false);
  if (answer->code() != v1::CODE_DONE && !options.json) fmt::print(stderr, "mocapctl: {}\n", answer->message());
  return exit_code_of(answer->code());
}

void add_wand(cli::App& calibrate, LiveOptions& options) {
  cli::App* wand = calibrate.add_subcommand("wand", "calibrate all cameras with a waved wand, and use the rig");
  wand->examples(
      "  mocapctl calibrate wand --wand 500\n"
      "  mocapctl calibrate wand --wand 0,160,500 --fov 60 --dry-run");
  add_connection_options(*wand, options);
  wand->add_option("--wand", options.wand,
                   "250, 400 or 500 (middle marker at 80, 130, 160 mm), or the positions of two or three markers in mm "
                   "from one end: 0,160,500. Measure your wand")
      ->capture_default_str();
  wand->add_option("--fov", options.request.calibration.fov_deg,
                   "horizontal field of view in degrees, approximate, of cameras without a calibrated lens: not in the "
                   "rig, or with a lens that came from --fov; calibrated lenses are kept")
      ->check(cli::Range(5.0, 150.0));
  wand->add_flag("--refine-lens", options.request.calibration.refine_lens,
                 "estimate the lenses, too, although they are calibrated; with --fov, replace all of them");
  wand->add_flag("--moved", options.request.calibration.moved,
                 "accept cameras that are not as in the rig before, or another scale");
  wand->add_option("--seconds", options.seconds, "largest duration; ends earlier when complete")
      ->check(cli::Range(1.0, 3600.0))
      ->capture_default_str();
  wand->add_flag("--dry-run", options.dry_run, "report only; the rig waits for calibrate apply");
  wand->callback([&options] { options.run = [&options] { return calibrate_with_wand(options); }; });
}

void add_floor(cli::App& calibrate, LiveOptions& options) {
  cli::App* floor = calibrate.add_subcommand("floor", "measure the floor with the markers that the daemon sees");
  floor->examples(
      "  mocapctl calibrate floor --frame 600,400\n"
      "  mocapctl calibrate floor --walk --height 40");
  add_connection_options(*floor, options);
  cli::add_floor_options(*floor, options.floor);
  floor->add_flag("--dry-run", options.dry_run, "report only; the rig waits for calibrate apply");
  floor->callback([&options] { options.run = [&options] { return measure_floor(options); }; });
}

}  // namespace

void add_calibrate_command(cli::App& app, LiveOptions& options) {
  cli::App* calibrate = app.add_subcommand("calibrate", "the running daemon calibrates its cameras");
  calibrate->examples(
      "  mocapctl calibrate wand --wand 500\n"
      "  mocapctl calibrate list");
  calibrate->require_subcommand(1);
  add_wand(*calibrate, options);
  add_floor(*calibrate, options);
  const struct {
    const char *name, *what, *example;
    CalibrationAction action;
  } commands[] = {
      {"status", "the progress, and the result", "calibrate status", CalibrationAction::Look},
      {"apply", "write the rig and use it; the rig before is kept", "calibrate apply", CalibrationAction::Apply},
      {"cancel", "end it without a result", "calibrate cancel", CalibrationAction::Cancel},
      {"list", "the rigs that the daemon keeps", "calibrate list", CalibrationAction::List},
      {"restore", "use a kept rig again", "calibrate restore 2026-03-01T09-30-00Z", CalibrationAction::Restore}};
  for (const auto& [name, what, example, action] : commands) {
    cli::App* command = calibrate->add_subcommand(name, what);
    command->examples(fmt::format("  mocapctl {0}\n  mocapctl {0} --endpoint tcp://10.0.0.7:5571", example));
    add_connection_options(*command, options);
    if (action == CalibrationAction::Restore) {
      command->add_option("name", options.request.calibration.name, "name in the list")->required();
    }
    command->callback([&options, action = action] {
      options.run = [&options, action] { return order_calibration(options, action); };
    });
  }
}

}  // namespace mocap::ctl
