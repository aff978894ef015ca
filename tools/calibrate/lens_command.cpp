#include "calibrate/lens_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <mutex>

#include "base/exit_codes.h"
#include "base/list_folder.h"
#include "base/time.h"
#include "calibrate/lens_report.h"
#include "calibrate/rig_output.h"
#include "calibrate/run_cameras.h"
#include "calibration/image_cells.h"
#include "settings/rig/rig_file.h"
#include "settings/rig/rig_lenses.h"

namespace mocap::calibrate {
namespace {

// Side of an ArUco marker over that of its square, as boards are usually printed.
constexpr double kDefaultMarkerRatio = 0.75;
// A camera is complete at this many views, coverage and reach. Chosen by hand; not yet measured.
constexpr std::size_t kCompleteViews = 25;
constexpr double kCompleteCoverage = 0.7;
constexpr double kCompleteReach = 0.85;

constexpr Duration kShowEvery = std::chrono::seconds(1);
// Without a terminal, progress is printed as lines.
constexpr Duration kPrintEvery = std::chrono::seconds(5);

volatile std::sig_atomic_t stop_requested = 0;

// Of a camera that failed, or delivered images that cannot be used.
Failure failure_of_run(const Error& error) {
  switch (error.code) {
    case ErrorCode::InvalidArgument: return {kExitData, error.message};
    case ErrorCode::Unsupported: return {kExitConfig, error.message};
    default: return {kExitUnavailable, error.message};
  }
}

bool is_complete(const LensViews& views) {
  if (views.full()) return true;
  if (views.views().size() < kCompleteViews) return false;
  const calibration::LensCoverage coverage = views.coverage();
  return coverage.share >= kCompleteCoverage && coverage.reach >= kCompleteReach;
}

// The progress of one camera, and where to show the board next.
std::string progress_of(const std::string& camera, const LensViews& views) {
  const calibration::LensCoverage coverage = views.coverage();
  std::string text = fmt::format("{}: {} boards in {} images, {:.0f} % covered", camera, views.views().size(),
                                 views.images(), 100.0 * coverage.share);
  if (is_complete(views)) return text + ", complete";
  const std::string missing = calibration::least_covered_region(coverage.corners, calibration::kImageCells);
  if (!missing.empty()) return text + ", show the board in " + missing;
  return text +
         (coverage.reach < kCompleteReach ? ", show the board nearer to the corners" : ", tilt the board to all sides");
}

}  // namespace

void LensCommand::add(cli::App& app) {
  command_ = app.add_subcommand(
      "lens", "calibrate lenses with a chessboard or a ChArUco board, shown to cameras or in image files");
  command_->examples(
      "  mocap-calibrate lens --config my.toml --columns 8 --rows 6 --square-mm 40\n"
      "  mocap-calibrate lens --images shots --camera cam1 --board chessboard --columns 9 --rows 7 --square-mm 25 "
      "--rig my.rig.toml");
  auto* config =
      command_->add_option("--config", config_, "configuration of the daemon; runs its cameras")->type_name("FILE");
  command_->add_option("--images", images_, "folder of images, or of one folder for each camera")
      ->type_name("FOLDER")
      ->excludes(config);
  command_->add_option("--camera", cameras_, "only these cameras; with --images, the name of the camera")
      ->type_name("NAME");
  command_->add_option("--rig", rig_, "rig file to write the lenses to; default: the configuration's")
      ->type_name("FILE");
  command_->add_option("--board", kind_)->check(cli::IsMember({"charuco", "chessboard"}))->capture_default_str();
  command_->add_option("--columns", board_.columns, "squares from left to right")->capture_default_str();
  command_->add_option("--rows", board_.rows, "squares from top to bottom")->capture_default_str();
  command_->add_option("--square-mm", square_mm_, "side of a square")
      ->check(cli::PositiveNumber{})
      ->capture_default_str();
  command_->add_option("--marker-mm", marker_mm_, "side of an ArUco marker; default: three quarters of a square");
  command_->add_option("--dictionary", board_.dictionary, "ArUco dictionary")->capture_default_str();
  command_->add_flag("--fisheye", fisheye_, "fisheye (equidistant) lenses instead of pinhole lenses");
  command_->add_option("--views", most_views_, "largest number of boards of each camera")
      ->check(cli::Range(6, 500))
      ->capture_default_str();
  command_->add_flag("--dry-run", dry_run_, "report only, write nothing");
  command_->add_flag("--json", json_, "print one JSON object");
}

std::optional<int> LensCommand::run() {
  if (!command_->parsed()) return std::nullopt;
  return run_lens();
}

int LensCommand::run_lens() {
  if (config_.empty() == images_.empty()) {
    print_message("lens needs --config (cameras) or --images (a folder)");
    return kExitUsage;
  }
  board_.kind = kind_ == "charuco" ? calibration::BoardKind::Charuco : calibration::BoardKind::Chessboard;
  board_.square_m = 1e-3 * square_mm_;
  board_.marker_m = 1e-3 * (marker_mm_ > 0.0 ? marker_mm_ : kDefaultMarkerRatio * square_mm_);
  const auto finder = calibration::BoardFinder::make(board_);
  if (!finder) {
    print_message("{}", finder.error().message);
    return kExitUsage;
  }
  const auto seen = see_boards(*finder);
  if (!seen) {
    print_message("{}", seen.error().message);
    return seen.error().exit;
  }
  return fit_and_write(*seen);
}

Result<std::vector<LensCommand::CameraViews>, Failure> LensCommand::see_boards(const calibration::BoardFinder& finder) {
  if (config_.empty()) {
    if (auto fault = fault_of_output()) return *std::move(fault);
    return read_folders(finder);
  }
  auto settings = settings::load_daemon_settings(config_, settings::RigNeed::AsFound);
  if (!settings) return Failure{kExitConfig, settings::to_text(settings.error())};
  if (rig_.empty()) rig_ = settings->capture.rig_file;
  if (auto fault = fault_of_output()) return *std::move(fault);
  keep_selected(*settings);
  if (settings->cameras.empty())
    return Failure{kExitUsage, fmt::format("{} has no camera with a name of --camera", config_.string())};
  return run_cameras_live(*settings, finder);
}

// Why the lenses could not be written: they would be lost after the boards were shown.
std::optional<Failure> LensCommand::fault_of_output() const {
  if (dry_run_) return std::nullopt;
  if (rig_.empty()) {
    return Failure{kExitUsage,
                   fmt::format("set the rig file to write the lenses to with --rig FILE{}, or use --dry-run",
                               config_.empty() ? "" : fmt::format(" or [capture] rig of '{}'", config_.string()))};
  }
  if (const Status writable = check_writable(rig_); !writable)
    return Failure{kExitCannotWrite, writable.error().message};
  return std::nullopt;
}

bool LensCommand::is_selected(const std::string& camera) const {
  return cameras_.empty() || std::ranges::find(cameras_, camera) != cameras_.end();
}

void LensCommand::keep_selected(settings::DaemonSettings& settings) const {
  for (std::size_t i = settings.cameras.size(); i-- > 0;) {
    if (is_selected(settings.cameras[i].name)) continue;
    const auto at = static_cast<std::ptrdiff_t>(i);  // all three lists are indexed by CameraId
    settings.cameras.erase(settings.cameras.begin() + at);
    settings.rig.erase(settings.rig.begin() + at);
    settings.simulated.erase(settings.simulated.begin() + at);
  }
}

Result<std::vector<LensCommand::CameraViews>, Failure> LensCommand::read_folders(
    const calibration::BoardFinder& finder) const {
  std::vector<std::string> names = cameras_;
  std::error_code failed;
  if (names.empty()) {
    for (const auto& folder : list_folder(images_).paths) {
      if (std::filesystem::is_directory(folder, failed)) names.push_back(folder.filename().string());
    }
  }
  if (names.empty())
    names.push_back(images_.filename().empty() ? images_.parent_path().filename().string()
                                               : images_.filename().string());
  std::vector<CameraViews> cameras;
  for (const std::string& name : names) {
    const auto files = images_of(images_, name);
    if (!files) return Failure{kExitNoInput, files.error().message};
    CameraViews& seen = cameras.emplace_back(CameraViews{name, LensViews(finder, most_views_)});
    for (const auto& file : *files) {
      const auto grey = read_grey(file);
      const Status added = grey ? seen.views.add(*grey) : Status(grey.error());
      if (!added)
        return Failure{kExitData, fmt::format("camera '{}': {}: {}", name, file.string(), added.error().message)};
    }
  }
  return cameras;
}

Result<std::vector<LensCommand::CameraViews>, Failure> LensCommand::run_cameras_live(
    const settings::DaemonSettings& settings, const calibration::BoardFinder& finder) const {
  std::vector<CameraViews> cameras;
  for (const auto& camera : settings.cameras) cameras.push_back({camera.name, LensViews(finder, most_views_)});
  std::vector<std::mutex> locks(cameras.size());  // views are added by camera threads and read by this thread
  std::vector<CameraRun> runs(cameras.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    runs[i].handle = [&, i](const Frame& frame, const runtime::CameraParts&) -> Result<RunState> {
      const auto grey = grey_of(frame.image);
      if (!grey) return Error{grey.error().code, fmt::format("camera '{}': {}", cameras[i].name, grey.error().message)};
      const std::scoped_lock lock(locks[i]);
      const Status added = cameras[i].views.add(*grey);
      if (!added)
        return Error{added.error().code, fmt::format("camera '{}': {}", cameras[i].name, added.error().message)};
      return is_complete(cameras[i].views) ? RunState::Finished : RunState::Continue;
    };
  }
  stop_requested = 0;
  const auto before = std::signal(SIGINT, [](int) { stop_requested = 1; });
  const bool terminal = isatty(STDERR_FILENO) != 0;
  Timestamp last_shown_at = host_now();
  run_cameras(settings, runs, [&] {
    if (host_now() - last_shown_at < (terminal ? kShowEvery : kPrintEvery)) return stop_requested == 0;
    last_shown_at = host_now();
    std::string line;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const std::scoped_lock lock(locks[i]);
      line += fmt::format("{}{}", line.empty() ? "" : "; ", progress_of(cameras[i].name, cameras[i].views));
    }
    if (terminal) fmt::print(stderr, "\r\x1b[2K{}   (Ctrl-C to end)", line);
    if (!terminal) print_message("{}", line);
    return stop_requested == 0;
  });
  std::signal(SIGINT, before);
  if (terminal) fmt::print(stderr, "\r\x1b[2K");
  for (const CameraRun& run : runs) {
    // After Ctrl-C, the views so far are used.
    if (!run.end && stop_requested == 0) return failure_of_run(run.end.error());
  }
  return cameras;
}

int LensCommand::fit_and_write(const std::vector<CameraViews>& cameras) {
  std::vector<LensOutcome> outcomes;
  Rig lenses;
  std::size_t refused = 0;
  for (const CameraViews& seen : cameras) {
    const LensViews& views = seen.views;
    outcomes.push_back({seen.name, views.images(), views.found(), views.width_px(), views.height_px(), views.coverage(),
                        calibration::fit_lens(views.views(), views.width_px(), views.height_px(),
                                              fisheye_ ? LensKind::Fisheye : LensKind::Pinhole)});
    const LensOutcome& outcome = outcomes.back();
    if (!json_) fmt::print("{}", lens_text(outcome));
    if (!outcome.fit) {
      ++refused;
      print_message("camera '{}': {}", seen.name, outcome.fit.error().message);
      continue;
    }
    lenses.push_back({.name = seen.name,
                      .width_px = outcome.width_px,
                      .height_px = outcome.height_px,
                      .lens = outcome.fit->lens,
                      .camera_from_world = {}});
  }
  if (json_) fmt::print("{}", lens_json(outcomes));
  if (refused > 0) {
    print_message("{} of {} cameras refused, nothing written", refused, cameras.size());
    return kExitData;
  }
  if (dry_run_) return kExitOk;
  if (const Status saved = settings::save_lenses(rig_, lenses); !saved) {
    print_message("{}", saved.error().message);
    return saved.error().code == ErrorCode::Io ? kExitCannotWrite : kExitData;
  }
  if (!json_) {
    fmt::print("{}: lenses of {} cameras written; calibrate their poses again (mocap-calibrate wand)\n", rig_.string(),
               lenses.size());
  }
  return kExitOk;
}

}  // namespace mocap::calibrate
