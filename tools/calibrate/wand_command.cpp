#include "calibrate/wand_command.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "calibrate/report_rig.h"
#include "calibrate/rig_output.h"
#include "calibration/rig/judge_rig.h"
#include "calibration/rig/old_rig.h"
#include "calibration/wand/solve_wand.h"
#include "calibration/wand/watch_wand.h"
#include "settings/rig_file.h"

namespace mocap::calibrate {
namespace {

using calibration::Wand;
using calibration::WandSolution;

constexpr double kSeconds = 180.0;
// Without a terminal progress is a line now and then.
constexpr double kTellEvery_s = 5.0;
// A rig that is larger than before by more was made with a wand that is told wrongly.
constexpr double kMostLarger = 0.01;

/// Follows the wand while live cameras run, and says when it is enough.
class WandCoach {
 public:
  WandCoach(const WandOptions& options, const Wand& wand, bool lens_known, Rig rig)
      : options_(options), watch_(rig, wand, {.lens_known = lens_known}), wand_(wand), rig_(std::move(rig)) {
    rough_.lens_known = lens_known;
    rough_.most_samples = 400;
    rough_.threads = options.threads;
    so_far_.cameras.resize(rig_.size());
  }

  bool look_on(const take::BlobRecording& since, double seconds) {
    for (std::size_t c = 0; c < since.pictures.size(); ++c) {
      for (const calibration::Picture& picture : pictures_of(since.pictures[c])) {
        watch_.add(c, picture);
        so_far_.cameras[c].push_back(picture);
      }
    }
    const bool enough = watch_.enough();
    const std::string advice = enough ? "enough" : watch_.advice();
    rate_when_due(seconds);
    show_progress(fmt::format("{:.0f} s: {}{}; {}", seconds, coverage(), quality_, advice));
    if (!on_terminal() && seconds >= tell_at_s_) {
      say("{:.0f} s: {}{}; {}", seconds, coverage(), quality_, advice);
      tell_at_s_ = seconds + kTellEvery_s;
    }
    return !enough;
  }

 private:
  std::string coverage() const {
    std::string text;
    for (std::size_t c = 0; c < rig_.size(); ++c) {
      const calibration::WandSeen seen = watch_.seen(c);
      text +=
          fmt::format("{}{} {}/{:.0f}%", text.empty() ? "" : ", ", rig_[c].name, seen.shared, 100.0 * seen.coverage);
    }
    return text;
  }

  // What a rig of the samples so far is worth; every 10 s, since it takes a moment.
  void rate_when_due(double seconds) {
    if (seconds < rate_at_s_) return;
    rate_at_s_ = seconds + 10.0;
    const auto rough = calibration::solve_wand(so_far_, rig_, wand_, rough_);
    if (!rough) return;
    double worst = 0.0;
    for (const auto& camera : rough->cameras) worst = std::max(worst, camera.doubt.position_m);
    quality_ = fmt::format("; so far {:.2f} px, cameras to {:.1f} mm", rough->rms_px, 1e3 * worst);
  }

  const WandOptions& options_;
  calibration::WandWatch watch_;
  Wand wand_;
  Rig rig_;
  calibration::WandSettings rough_;
  calibration::Take so_far_;
  std::string quality_;
  double rate_at_s_ = 10.0;
  double tell_at_s_ = kTellEvery_s;
};

std::filesystem::path lens_file(const WandOptions& options, const Gathered& gathered) {
  if (!options.rig.empty()) return options.rig;
  std::error_code ignored;
  return std::filesystem::exists(gathered.rig_file, ignored) ? gathered.rig_file : std::filesystem::path{};
}

std::optional<UnknownLens> unknown_lens(const WandOptions& options) {
  if (!options.fov_deg) return std::nullopt;
  return UnknownLens{*options.fov_deg, options.fisheye ? LensKind::Fisheye : LensKind::Pinhole};
}

Result<Gathered, Failure> gather(const WandOptions& options, const Wand& wand) {
  std::optional<WandCoach> coach;
  std::optional<Failure> failed;
  TakeOptions take = options.take;
  if (take.seconds <= 0.0 && take.blobs.empty()) take.seconds = kSeconds;
  auto gathered = gather_blobs(take, [&](const Gathered& so_far, const take::BlobRecording& since, double seconds) {
    if (!coach) {
      auto rig = with_lenses(so_far, lens_file(options, so_far), unknown_lens(options));
      if (!rig) {
        failed = rig.error();
        return false;
      }
      coach.emplace(options, wand, !options.fov_deg, std::move(*rig));
    }
    return coach->look_on(since, seconds);
  });
  if (failed) return *failed;
  return gathered;
}

settings::RigMetadata facts_of(const WandSolution& solution, const std::string& floor) {
  settings::RigMetadata facts;
  facts["rms_px"] = solution.rms_px;
  facts["heldout_px"] = solution.heldout_px;
  facts["samples"] = static_cast<double>(solution.samples);
  facts["wand_length_mm"] = 1e3 * solution.bundle.wand.length_m();
  facts["wand_std_mm"] = 1e3 * solution.length_std_m;
  facts["floor"] = floor;
  for (std::size_t c = 0; c < solution.cameras.size(); ++c) {
    facts[solution.bundle.rig[c].name + ".rms_px"] = solution.cameras[c].rms_px;
    facts[solution.bundle.rig[c].name + ".position_sigma_mm"] = 1e3 * solution.cameras[c].doubt.position_m;
  }
  return facts;
}

/// The rig in the world that it was in before, where its cameras still stand so; else about upright.
struct Laid {
  Rig rig;
  std::optional<calibration::Floor> kept;
  std::string floor;
};

Laid lay(const WandSolution& solution, const Rig& before) {
  const Rig& rig = solution.bundle.rig;
  if (const auto kept = calibration::floor_of_old(rig, before)) return {calibration::laid_on(*kept, rig), kept, "kept"};
  std::vector<Eigen::Vector3d> points;
  for (const calibration::WandPlace& place : solution.bundle.places) points.push_back(place.middle_m);
  return {calibration::laid_on(calibration::floor_by_guess(points, rig), rig), {}, "guessed"};
}

// The report to the terminal and to the files that were asked for.
Status tell(const WandOptions& options, const WandSolution& solution, const Laid& laid, const Rig& before) {
  const calibration::RigEvidence evidence = calibration::evidence_of(solution, laid.kept);
  const calibration::RigJudgement judgement = calibration::judge_rig(evidence);
  RigReport report{.title = "wand", .evidence = evidence, .judgement = judgement};
  if (laid.kept) {
    const auto change = calibration::compare_rigs(before, laid.rig, calibration::RigAlignment::MostStayed);
    if (change) report.since_old = *change;
  }
  if (!options.truth.empty()) {
    const auto truth = settings::load_rig(options.truth);
    if (!truth) return Error{ErrorCode::InvalidArgument, settings::to_text(truth.error())};
    const auto change = calibration::compare_rigs(*truth, laid.rig, calibration::RigAlignment::AllCameras);
    if (!change) return change.error();
    report.to_truth = *change;
  }
  fmt::print("{}", report_text(report));
  for (const std::filesystem::path& path : options.reports) {
    if (const Status written = write_report(path, report); !written) return written;
  }
  return {};
}

std::optional<Failure> refuse_size(const WandSolution& solution, const Rig& before, const WandOptions& options) {
  if (options.moved) return std::nullopt;
  const auto larger = calibration::times_larger(solution.bundle.rig, before);
  if (!larger || std::abs(*larger - 1.0) < kMostLarger) return std::nullopt;
  const double told_mm = 1e3 * solution.bundle.wand.length_m();
  return Failure{
      kExitData,
      fmt::format("the cameras stand as in the rig before, but {:.3f} times as far apart: the wand is {:.0f} mm "
                  "long, told was {:.0f}; say its length with --wand, or --moved where the rig before is wrong",
                  *larger, told_mm / *larger, told_mm)};
}

int solve_and_write(const WandOptions& options, const Gathered& gathered, const Wand& wand) {
  const auto before = with_lenses(gathered, lens_file(options, gathered), unknown_lens(options));
  if (!before) {
    say("{}", before.error().message);
    return before.error().exit;
  }
  const std::filesystem::path out = !options.out.empty() ? options.out : gathered.rig_file;
  calibration::WandSettings settings;
  settings.lens_known = !options.fov_deg;
  settings.refine_lens = options.refine_lens;
  settings.threads = options.threads;
  const int ends = ends_asked();
  const auto solution = calibration::solve_wand(take_of(gathered.recording), *before, wand, settings,
                                                [&](const char* doing, double share) {
                                                  show_progress(fmt::format("{} {:.0f} %", doing, 100.0 * share));
                                                  return ends_asked() == ends;
                                                });
  end_progress();
  if (!solution) {
    say("{}", solution.error().message);
    return kExitData;
  }
  if (const auto refused = refuse_size(*solution, *before, options)) {
    say("{}", refused->message);
    return refused->exit;
  }
  const Laid laid = lay(*solution, *before);
  if (const Status told = tell(options, *solution, laid, *before); !told) {
    say("{}", told.error().message);
    return kExitUnavailable;
  }
  fmt::print("floor: {}\n",
             laid.floor == "kept" ? "where it was" : "a guess; lay the floor frame down and run mocap-calibrate floor");
  if (options.dry_run) {
    fmt::print("{} is as it was (--dry-run)\n", out.string());
    return kExitOk;
  }
  return write_rig(out, laid.rig, facts_of(*solution, laid.floor), "wand");
}

}  // namespace

Result<Wand> parse_wand(const std::string& text) {
  static const std::map<std::string, std::vector<double>> kPresets{
      {"500", {0.0, 160.0, 500.0}}, {"400", {0.0, 130.0, 400.0}}, {"250", {0.0, 80.0, 250.0}}};
  std::vector<double> marks_mm;
  if (const auto preset = kPresets.find(text); preset != kPresets.end()) {
    marks_mm = preset->second;
  } else {
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) {
      std::istringstream number(part);
      double mm = 0.0;
      if (!(number >> mm) || !number.eof() || !std::isfinite(mm)) mm = -1.0;
      marks_mm.push_back(mm);
    }
  }
  const bool ascends = std::ranges::adjacent_find(marks_mm, std::greater_equal<>{}) == marks_mm.end();
  if (marks_mm.size() < 2 || marks_mm.size() > calibration::kMostMarks || marks_mm[0] != 0.0 || !ascends ||
      marks_mm.back() > 10000.0) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("wand is '{}', expected 250, 400 or 500, or the places of its two or three markers from one "
                    "end in mm, in the order in which they sit on it: 0,160,500",
                    text)};
  }
  Wand wand;
  for (const double mm : marks_mm) wand.marks_m.push_back(1e-3 * mm);
  return wand;
}

void add_wand_command(cli::App& app, WandOptions& options) {
  cli::App* wand = app.add_subcommand("wand", "wave a wand before all cameras: where they stand, how they look");
  add_take_options(*wand, options.take);
  wand->add_option(
          "--wand,--length", options.wand,
          "250, 400 or 500 (middle markers at 80, 130, 160 mm), or the places of two or three markers in mm from "
          "one end: 0,160,500. Measure yours")
      ->capture_default_str();
  auto* rig = wand->add_option("--rig", options.rig,
                               "whose lenses are good, and whose floor is kept; default: the "
                               "configuration's")
                  ->type_name("FILE");
  wand->add_option("--fov", options.fov_deg, "no lenses are known: the cameras look about so wide, degrees")
      ->check(cli::Range(5.0, 150.0))
      ->excludes(rig);
  wand->add_flag("--fisheye", options.fisheye, "with --fov: they are fisheye lenses (equidistant)");
  wand->add_flag("--refine-lens", options.refine_lens, "solve for the lenses, too, though they are known");
  wand->add_flag("--moved", options.moved, "the cameras, or the wand, are not as in the rig before");
  wand->add_option("--seconds", options.take.seconds,
                   "of live cameras at most; default 180, and less when it is enough")
      ->check(cli::Range(1.0, 3600.0));
  wand->add_option("--out", options.out, "the rig file to write; default: the configuration's")->type_name("FILE");
  wand->add_option("--report", options.reports, "writes the report, too, as the file's name ends: .svg, .json, or text")
      ->type_name("FILE");
  wand->add_option("--truth", options.truth, "a rig that is known to be right; the report tells how far off it is")
      ->type_name("FILE");
  wand->add_flag("--dry-run", options.dry_run, "say what comes out, write nothing");
  wand->add_option("--threads", options.threads)->check(cli::Range(1, 64))->capture_default_str();
}

int run_wand(const WandOptions& options) {
  const auto wand = parse_wand(options.wand);
  if (!wand) {
    say("{}", wand.error().message);
    return kExitUsage;
  }
  if (options.out.empty() && options.take.config.empty() && !options.dry_run) {
    say("say where the rig is written with --out FILE");
    return kExitUsage;
  }
  catch_end();
  if (options.take.blobs.empty())
    say("wave the wand through the whole volume, turning it; end with Ctrl-C, or wait until it is enough");
  const auto gathered = gather(options, *wand);
  if (!gathered) {
    say("{}", gathered.error().message);
    return gathered.error().exit;
  }
  return solve_and_write(options, *gathered, *wand);
}

}  // namespace mocap::calibrate
