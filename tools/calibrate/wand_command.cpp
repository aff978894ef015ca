#include "calibrate/wand_command.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibrate/report_rig.h"
#include "calibrate/rig_output.h"
#include "calibration/rig/approximate_lens.h"
#include "calibration/rig/assess_rig.h"
#include "calibration/wand/parse_wand.h"
#include "calibration/wand/solve_wand.h"
#include "calibration/wand/wand_progress.h"
#include "calibration/wand/wand_rig.h"
#include "lib/rigcheck/recorded_spots.h"
#include "settings/rig/rig_file.h"

namespace mocap::calibrate {
namespace {

using calibration::PlacedRig;
using calibration::Wand;
using calibration::WandSolution;

constexpr double kSeconds = 180.0;
// Without a terminal, progress is printed as lines.
constexpr double kPrintEvery_s = 5.0;
constexpr double kSolveEvery_s = 10.0;

/// Shows the progress of a recording and the next advice to the operator while live cameras run.
class WandCoach {
 public:
  WandCoach(const WandOptions& options, const Wand& wand, bool lens_known, Rig rig)
      : options_(options), progress_(rig, wand, {.lens_known = lens_known}), wand_(wand), rig_(std::move(rig)) {
    quick_settings_.lens_known = lens_known;
    quick_settings_.max_samples = 400;
    quick_settings_.threads = options.threads;
    so_far_.cameras.resize(rig_.size());
  }

  bool observe(const take::BlobRecording& since, double seconds) {
    for (std::size_t c = 0; c < since.pictures.size(); ++c) {
      for (const calibration::Picture& picture : rigcheck::spots_of(since.pictures[c])) {
        progress_.add(c, picture);
        so_far_.cameras[c].push_back(picture);
      }
    }
    const bool complete = progress_.is_complete();
    const std::string advice = complete ? "complete" : progress_.advice();
    solve_when_due(seconds);
    show_progress(fmt::format("{:.0f} s: {}{}; {}", seconds, coverage(), accuracy_text_, advice));
    if (!on_terminal() && seconds >= print_at_s_) {
      print_message("{:.0f} s: {}{}; {}", seconds, coverage(), accuracy_text_, advice);
      print_at_s_ = seconds + kPrintEvery_s;
    }
    return !complete;
  }

 private:
  std::string coverage() const {
    std::string text;
    for (std::size_t c = 0; c < rig_.size(); ++c) {
      const calibration::CameraProgress camera = progress_.progress_of(c);
      text += fmt::format("{}{} {}/{:.0f}%", text.empty() ? "" : ", ", rig_[c].name, camera.shared,
                          100.0 * camera.coverage);
    }
    return text;
  }

  // Calibrates with the samples so far, every 10 s.
  void solve_when_due(double seconds) {
    if (seconds < solve_at_s_) return;
    solve_at_s_ = seconds + kSolveEvery_s;
    const auto quick = calibration::solve_wand(so_far_, rig_, wand_, quick_settings_);
    if (!quick) {
      accuracy_text_ = fmt::format("; no solution so far: {}", quick.error().message);
      return;
    }
    std::optional<double> worst_m = 0.0;
    for (const auto& camera : quick->cameras) {
      if (!camera.uncertainty || !worst_m) {
        worst_m.reset();
      } else {
        worst_m = std::max(*worst_m, camera.uncertainty->position_m);
      }
    }
    accuracy_text_ = fmt::format("; so far {:.2f} px, camera positions {}", quick->rms_px,
                                 worst_m ? fmt::format("to {:.1f} mm", 1e3 * *worst_m) : "not determined");
  }

  const WandOptions& options_;
  calibration::WandProgress progress_;
  Wand wand_;
  Rig rig_;
  calibration::WandSettings quick_settings_;
  calibration::Take so_far_;
  std::string accuracy_text_;
  double solve_at_s_ = kSolveEvery_s;
  double print_at_s_ = kPrintEvery_s;
};

// The rig before, with the lenses that are kept; empty: none.
std::filesystem::path lens_file(const WandOptions& options, const GatheredBlobs& gathered) {
  if (!options.rig.empty()) return options.rig;
  std::error_code ignored;
  if (std::filesystem::exists(gathered.rig_file, ignored)) return gathered.rig_file;
  return std::filesystem::exists(options.out, ignored) ? options.out : std::filesystem::path{};
}

std::optional<calibration::ApproximateLens> approximate_lens(const WandOptions& options) {
  if (!options.fov_deg) return std::nullopt;
  return calibration::ApproximateLens{*options.fov_deg, options.fisheye ? LensKind::Fisheye : LensKind::Pinhole};
}

std::filesystem::path rig_to_write(const WandOptions& options, const GatheredBlobs& gathered) {
  return !options.out.empty() ? options.out : gathered.rig_file;
}

// The rig with the lenses with which the calibration starts.
Result<Rig, Failure> rig_to_start_with(const WandOptions& options, const GatheredBlobs& gathered) {
  const auto approximate = approximate_lens(options);
  auto rig = rig_with_lenses(gathered, lens_file(options, gathered), approximate);
  if (!rig || !approximate || !options.refine_lens) return rig;
  for (CameraModel& camera : *rig) camera.lens = calibration::lens_of(*approximate, camera.width_px, camera.height_px);
  return rig;
}

// Whether --fov is used for no camera of the rig_to_start_with.
bool is_lens_known(const WandOptions& options, const Rig& rig) {
  return !options.fov_deg || std::ranges::none_of(rig, calibration::takes_field_of_view);
}

Result<GatheredBlobs, Failure> gather(const WandOptions& options, const Wand& wand) {
  std::optional<WandCoach> coach;
  std::optional<Failure> failed;
  RecordingOptions take = options.take;
  if (take.seconds <= 0.0 && take.blobs.empty()) take.seconds = kSeconds;
  auto gathered =
      gather_blobs(take, [&](const GatheredBlobs& so_far, const take::BlobRecording& since, double seconds) {
        if (!coach) {
          auto rig = rig_to_start_with(options, so_far);
          if (!rig) {
            failed = rig.error();
            return false;
          }
          coach.emplace(options, wand, is_lens_known(options, *rig), std::move(*rig));
        }
        return coach->observe(since, seconds);
      });
  if (failed) return *failed;
  return gathered;
}

// The first reason why the result could not be written or compared: it would be lost after the waving.
std::optional<Failure> fault_of_files(const WandOptions& options) {
  if (!options.dry_run) {
    if (const auto rig = check_rig_output(options.out, options.take.config); !rig) return rig.error();
  }
  for (const std::filesystem::path& file : options.reports) {
    if (const Status writable = check_writable(file); !writable)
      return Failure{kExitCannotWrite, writable.error().message};
  }
  if (options.truth.empty()) return std::nullopt;
  if (const auto truth = settings::load_rig(options.truth); !truth)
    return Failure{kExitConfig, settings::to_text(truth.error())};
  return std::nullopt;
}

// The errors against the rig of --truth; nothing without one.
Result<std::optional<calibration::RigChange>, Failure> change_to_truth(const WandOptions& options, const Rig& rig) {
  if (options.truth.empty()) return std::optional<calibration::RigChange>{};
  const auto truth = settings::load_rig(options.truth);
  if (!truth) return Failure{kExitConfig, settings::to_text(truth.error())};
  auto change = calibration::compare_rigs(*truth, rig, calibration::RigAlignment::AllCameras);
  if (!change)
    return Failure{kExitData, fmt::format("--truth '{}': {}", options.truth.string(), change.error().message)};
  return std::optional(*std::move(change));
}

// Reports to the terminal, writes the rig, and then the files of --report, so that a report that fails loses no rig.
int report_and_write(const WandOptions& options, const std::filesystem::path& out, const WandSolution& solution,
                     const PlacedRig& placed, const Rig& before) {
  const calibration::RigEvidence evidence = calibration::evidence_of(solution, calibration::measured_world(placed));
  const calibration::RigAssessment assessment = calibration::assess_rig(evidence);
  RigReport report{.title = "wand", .evidence = evidence, .assessment = assessment};
  if (placed.previous_world) {
    const auto change = calibration::compare_rigs(before, placed.rig, calibration::RigAlignment::RobustToMoved);
    if (change) report.since_previous = *change;
  }
  const auto to_truth = change_to_truth(options, placed.rig);
  if (to_truth) report.to_truth = *to_truth;
  fmt::print("{}", report_text(report));
  fmt::print("floor: {}\n",
             placed.floor_is_guessed ? "provisional; measure it with mocap-calibrate floor" : "where it was");
  int exit = kExitOk;
  if (options.dry_run) {
    fmt::print("{}: unchanged (--dry-run)\n", out.string());
  } else {
    exit = write_rig(out, placed.rig, calibration::facts_of(solution, placed), "wand");
  }
  const auto fail = [&exit](const Failure& failure) {
    print_message("{}", failure.message);
    if (exit == kExitOk) exit = failure.exit;
  };
  if (!to_truth) fail(to_truth.error());
  for (const std::filesystem::path& path : options.reports) {
    if (const Status written = write_report(path, report); !written) fail({kExitCannotWrite, written.error().message});
  }
  return exit;
}

int solve_and_write(const WandOptions& options, const GatheredBlobs& gathered, const Wand& wand) {
  const auto before = rig_to_start_with(options, gathered);
  if (!before) {
    print_message("{}", before.error().message);
    return before.error().exit;
  }
  if (const auto kept = calibration::lenses_that_are_kept(*before); kept && options.fov_deg) print_message("{}", *kept);
  calibration::WandSettings settings;
  settings.lens_known = is_lens_known(options, *before);
  settings.refine_lens = options.refine_lens;
  settings.threads = options.threads;
  const int ends = stop_requests();
  const auto solution = calibration::solve_wand(rigcheck::spots_of(gathered.recording), *before, wand, settings,
                                                [&](const char* step, double fraction) {
                                                  show_progress(fmt::format("{} {:.0f} %", step, 100.0 * fraction));
                                                  return stop_requests() == ends;
                                                });
  clear_progress();
  if (!solution) {
    print_message("{}", solution.error().message);
    return kExitData;
  }
  if (const auto refused = options.moved ? std::nullopt : calibration::wrong_scale(*solution, *before)) {
    print_message("{}", *refused);
    return kExitData;
  }
  const PlacedRig placed =
      calibration::place_in_world(*solution, {*before, settings::floor_is_guessed(lens_file(options, gathered))});
  return report_and_write(options, rig_to_write(options, gathered), *solution, placed, *before);
}

}  // namespace

void add_wand_command(cli::App& app, WandOptions& options) {
  cli::App* wand = app.add_subcommand("wand", "calibrate all cameras with a waved wand");
  add_recording_options(*wand, options.take);
  wand->examples(
      "  mocap-calibrate wand --config my.toml --wand 500\n"
      "  mocap-calibrate wand --blobs take.blobs --fov 60 --out my.rig.toml --report wand.svg");
  wand->add_option(
          "--wand,--length", options.wand,
          "250, 400 or 500 (middle marker at 80, 130, 160 mm), or the positions of two or three markers in mm from "
          "one end: 0,160,500. Measure your wand")
      ->capture_default_str();
  wand->add_option(
          "--rig", options.rig,
          "rig file with calibrated lenses, and with the floor to keep; default: the configuration's, or --out")
      ->type_name("FILE");
  wand->add_option("--fov", options.fov_deg,
                   "horizontal field of view in degrees, approximate, of cameras without a calibrated lens: not in the "
                   "rig, or with a lens that came from --fov; calibrated lenses are kept")
      ->check(cli::Range(5.0, 150.0));
  wand->add_flag("--fisheye", options.fisheye, "with --fov: such lenses are fisheye lenses (equidistant)");
  wand->add_flag("--refine-lens", options.refine_lens,
                 "estimate the lenses, too, although they are calibrated; with --fov, replace all of them");
  wand->add_flag("--moved", options.moved, "accept cameras that are not as in the previous rig, or another scale");
  wand->add_option("--seconds", options.take.seconds,
                   "largest duration of live cameras; default 180; ends earlier when the recording is complete")
      ->check(cli::Range(1.0, 3600.0));
  wand->add_option("--out", options.out, "rig file to write; default: the configuration's")->type_name("FILE");
  wand->add_option("--report", options.reports, "write the report to a file; its suffix decides: .svg, .json, or text")
      ->type_name("FILE");
  wand->add_option("--truth", options.truth, "rig file with the truth; the report has the errors against it")
      ->type_name("FILE");
  wand->add_flag("--dry-run", options.dry_run, "report only, write nothing");
  wand->add_option("--threads", options.threads)->check(cli::Range(1, 64))->capture_default_str();
}

int run_wand(const WandOptions& options) {
  const auto wand = calibration::parse_wand(options.wand);
  if (!wand) {
    print_message("{}", wand.error().message);
    return kExitUsage;
  }
  if (const auto fault = fault_of_files(options)) {
    print_message("{}", fault->message);
    return fault->exit;
  }
  catch_signals();
  if (options.take.blobs.empty())
    print_message("wave the wand through the whole volume in all directions; ends when complete, or with Ctrl-C");
  return work_on_blobs(gather(options, *wand),
                       [&](const GatheredBlobs& gathered) { return solve_and_write(options, gathered, *wand); });
}

}  // namespace mocap::calibrate
