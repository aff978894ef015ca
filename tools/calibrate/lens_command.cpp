#include "calibrate/lens_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <mutex>

#include "base/exit_codes.h"
#include "base/time.h"
#include "calibrate/lens_report.h"
#include "calibrate/run_cameras.h"
#include "calibration/wand/emptiest_part.h"
#include "settings/rig_file.h"
#include "settings/rig_lenses.h"

namespace mocap::calibrate {
namespace {

constexpr int kExitData = 65;  // sysexits EX_DATAERR
// ArUco markers need a white rim in their squares; this is what boards are usually printed with.
constexpr double kUsualMarker = 0.75;
// Live: it is enough when so much was seen, however many boards it took.
constexpr std::size_t kEnoughViews = 25;
constexpr double kEnoughCovered = 0.7;
constexpr double kEnoughReach = 0.85;

constexpr Duration kShowEvery = std::chrono::seconds(1);
// Without a terminal progress is a line now and then.
constexpr Duration kTellEvery = std::chrono::seconds(5);

volatile std::sig_atomic_t end_asked = 0;

void say(const std::string& text) { fmt::print(stderr, "mocap-calibrate: {}\n", text); }

int exit_code_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::InvalidArgument: return kExitData;
    case ErrorCode::Unsupported: return kExitConfig;
    default: return kExitUnavailable;
  }
}

bool is_enough(const LensViews& views) {
  if (views.full()) return true;
  if (views.views().size() < kEnoughViews) return false;
  const calibration::LensCoverage coverage = views.coverage();
  return coverage.share >= kEnoughCovered && coverage.reach >= kEnoughReach;
}

// What one camera has seen, and where the board should go next.
std::string progress_of(const std::string& camera, const LensViews& views) {
  const calibration::LensCoverage coverage = views.coverage();
  std::string text = fmt::format("{}: {} boards in {} images, {:.0f} % covered", camera, views.views().size(),
                                 views.images(), 100.0 * coverage.share);
  if (is_enough(views)) return text + ", enough";
  const std::string missing = calibration::emptiest_part(coverage.corners, calibration::kLensFields);
  if (!missing.empty()) return text + ", show it in " + missing;
  return text + (coverage.reach < kEnoughReach ? ", show it nearer to the corners" : ", tilt it to all sides");
}

}  // namespace

void LensCommand::add(cli::App& app) {
  command_ = app.add_subcommand("lens", "lenses from a chessboard or a ChArUco board, shown to cameras or in images");
  auto* config =
      command_->add_option("--config", config_, "the daemon's configuration: its cameras are run")->type_name("FILE");
  command_->add_option("--images", images_, "a folder of images, or of one folder a camera")
      ->type_name("FOLDER")
      ->excludes(config);
  command_->add_option("--camera", cameras_, "only this one, or these; its name with --images")->type_name("NAME");
  command_->add_option("--rig", rig_, "the rig that gets the lenses; default: the configuration's")->type_name("FILE");
  command_->add_option("--board", kind_)->check(cli::IsMember({"charuco", "chessboard"}))->capture_default_str();
  command_->add_option("--columns", board_.columns, "squares from left to right")->capture_default_str();
  command_->add_option("--rows", board_.rows, "squares from top to bottom")->capture_default_str();
  command_->add_option("--square-mm", square_mm_, "side of a square")
      ->check(cli::PositiveNumber{})
      ->capture_default_str();
  command_->add_option("--marker-mm", marker_mm_, "side of a marker; default: three quarters of a square");
  command_->add_option("--dictionary", board_.dictionary, "of the markers")->capture_default_str();
  command_->add_flag("--fisheye", fisheye_, "fisheye (equidistant) lenses instead of pinhole ones");
  command_->add_option("--views", most_views_, "boards of each camera that are used")
      ->check(cli::Range(6, 500))
      ->capture_default_str();
  command_->add_flag("--dry-run", dry_run_, "say what it would do, write nothing");
  command_->add_flag("--json", json_, "print one JSON object");
}

std::optional<int> LensCommand::run() {
  if (!command_->parsed()) return std::nullopt;
  return run_lens();
}

int LensCommand::run_lens() {
  if (config_.empty() == images_.empty()) {
    say("lens needs --config (cameras) or --images (a folder)");
    return kExitUsage;
  }
  if (config_.empty() && rig_.empty() && !dry_run_) {
    say("with --images say --rig, the file that gets the lenses, or --dry-run");
    return kExitUsage;
  }
  board_.kind = kind_ == "charuco" ? calibration::BoardKind::Charuco : calibration::BoardKind::Chessboard;
  board_.square_m = 1e-3 * square_mm_;
  board_.marker_m = 1e-3 * (marker_mm_ > 0.0 ? marker_mm_ : kUsualMarker * square_mm_);
  const auto finder = calibration::BoardFinder::make(board_);
  if (!finder) {
    say(finder.error().message);
    return kExitUsage;
  }
  const auto seen = config_.empty() ? look_through_folders(*finder) : watch_cameras(*finder);
  if (!seen) {
    say(seen.error().message);
    return exit_code_of(seen.error().code);
  }
  return fit_and_write(*seen);
}

bool LensCommand::is_wanted(const std::string& camera) const {
  return cameras_.empty() || std::ranges::find(cameras_, camera) != cameras_.end();
}

void LensCommand::keep_wanted(settings::DaemonSettings& settings) const {
  for (std::size_t i = settings.cameras.size(); i-- > 0;) {
    if (is_wanted(settings.cameras[i].name)) continue;
    const auto at = static_cast<std::ptrdiff_t>(i);  // all three are by CameraId
    settings.cameras.erase(settings.cameras.begin() + at);
    settings.rig.erase(settings.rig.begin() + at);
    settings.simulated.erase(settings.simulated.begin() + at);
  }
}

Result<std::vector<LensCommand::Seen>> LensCommand::look_through_folders(const calibration::BoardFinder& finder) const {
  std::vector<std::string> names = cameras_;
  std::error_code failed;
  if (names.empty()) {
    for (const auto& entry : std::filesystem::directory_iterator(images_, failed)) {
      if (entry.is_directory(failed)) names.push_back(entry.path().filename().string());
    }
    std::ranges::sort(names);
  }
  if (names.empty())
    names.push_back(images_.filename().empty() ? images_.parent_path().filename().string()
                                               : images_.filename().string());
  std::vector<Seen> cameras;
  for (const std::string& name : names) {
    const auto files = images_of(images_, name);
    if (!files) return files.error();
    Seen& seen = cameras.emplace_back(Seen{name, LensViews(finder, most_views_)});
    for (const auto& file : *files) {
      const auto grey = read_grey(file);
      const Status taken = grey ? seen.views.take(*grey) : Status(grey.error());
      if (!taken) {
        return Error{taken.error().code,
                     fmt::format("camera '{}': {}: {}", name, file.string(), taken.error().message)};
      }
    }
  }
  return cameras;
}

Result<std::vector<LensCommand::Seen>> LensCommand::watch_cameras(const calibration::BoardFinder& finder) {
  auto settings = settings::load_daemon_settings(config_, settings::RigNeed::AsFound);
  if (!settings) {
    fmt::print(stderr, "{}\n", settings::to_text(settings.error()));
    return Error{ErrorCode::Unsupported, fmt::format("{}: nothing was run", config_.string())};
  }
  if (rig_.empty()) rig_ = settings->capture.rig_file;
  keep_wanted(*settings);
  if (settings->cameras.empty()) {
    return Error{ErrorCode::InvalidArgument, fmt::format("{} has no camera that --camera names", config_.string())};
  }
  std::vector<Seen> cameras;
  for (const auto& camera : settings->cameras) cameras.push_back({camera.name, LensViews(finder, most_views_)});
  std::vector<std::mutex> looking(cameras.size());  // boards are taken by camera threads, and shown by this one
  std::vector<CameraRun> runs(cameras.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    runs[i].take = [&, i](const Frame& frame, const runtime::CameraParts&) -> Result<Wish> {
      const auto grey = grey_of(frame.image);
      if (!grey) return Error{grey.error().code, fmt::format("camera '{}': {}", cameras[i].name, grey.error().message)};
      const std::scoped_lock lock(looking[i]);
      const Status taken = cameras[i].views.take(*grey);
      if (!taken)
        return Error{taken.error().code, fmt::format("camera '{}': {}", cameras[i].name, taken.error().message)};
      return is_enough(cameras[i].views) ? Wish::Enough : Wish::More;
    };
  }
  end_asked = 0;
  const auto before = std::signal(SIGINT, [](int) { end_asked = 1; });
  const bool terminal = isatty(STDERR_FILENO) != 0;
  Timestamp told_at = host_now();
  run_cameras(*settings, runs, [&] {
    if (host_now() - told_at < (terminal ? kShowEvery : kTellEvery)) return end_asked == 0;
    told_at = host_now();
    std::string line;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const std::scoped_lock lock(looking[i]);
      line += fmt::format("{}{}", line.empty() ? "" : "; ", progress_of(cameras[i].name, cameras[i].views));
    }
    if (terminal) fmt::print(stderr, "\r\x1b[2K{}   (Ctrl-C when it is enough)", line);
    if (!terminal) say(line);
    return end_asked == 0;
  });
  std::signal(SIGINT, before);
  if (terminal) fmt::print(stderr, "\r\x1b[2K");
  for (const CameraRun& run : runs) {
    // Whoever asked for the end has what there is.
    if (!run.end && end_asked == 0) return run.end.error();
  }
  return cameras;
}

int LensCommand::fit_and_write(const std::vector<Seen>& cameras) {
  std::vector<LensOutcome> outcomes;
  Rig lenses;
  std::size_t refused = 0;
  for (const Seen& seen : cameras) {
    const LensViews& views = seen.views;
    outcomes.push_back({seen.name, views.images(), views.found(), views.width_px(), views.height_px(), views.coverage(),
                        calibration::fit_lens(views.views(), views.width_px(), views.height_px(),
                                              fisheye_ ? LensKind::Fisheye : LensKind::Pinhole)});
    const LensOutcome& outcome = outcomes.back();
    if (!json_) fmt::print("{}", lens_text(outcome));
    if (!outcome.fit) {
      ++refused;
      say(fmt::format("camera '{}': {}", seen.name, outcome.fit.error().message));
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
    say(fmt::format("{} of {} cameras refused, nothing written", refused, cameras.size()));
    return kExitData;
  }
  if (dry_run_) return kExitOk;
  if (const Status saved = settings::save_lenses(rig_, lenses); !saved) {
    say(saved.error().message);
    return exit_code_of(saved.error().code);
  }
  if (!json_) {
    fmt::print(
        "{}: lenses of {} cameras written; where they stand must be solved anew with them (mocap-calibrate "
        "wand)\n",
        rig_.string(), lenses.size());
  }
  return kExitOk;
}

}  // namespace mocap::calibrate
