#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "calibrate/lens_views.h"
#include "calibration/lens/fit_lens.h"
#include "lib/cli/app.h"
#include "settings/daemon_settings.h"

namespace mocap::calibrate {

/// `mocap-calibrate lens`: lenses from images of a chessboard or a ChArUco board.
class LensCommand {
 public:
  void add(cli::App& app);
  /// The exit code; nothing where it was not asked for.
  std::optional<int> run();

 private:
  /// One camera, and what it saw.
  struct Seen {
    std::string name;
    LensViews views;
  };

  int run_lens();
  Result<std::vector<Seen>> look_through_folders(const calibration::BoardFinder& finder) const;
  Result<std::vector<Seen>> watch_cameras(const calibration::BoardFinder& finder);
  bool is_wanted(const std::string& camera) const;
  void keep_wanted(settings::DaemonSettings& settings) const;
  int fit_and_write(const std::vector<Seen>& cameras);

  cli::App* command_ = nullptr;
  std::filesystem::path config_;
  std::filesystem::path images_;
  std::filesystem::path rig_;
  std::vector<std::string> cameras_;
  std::string kind_ = "charuco";
  calibration::Board board_;
  double square_mm_ = 40.0;
  double marker_mm_ = 0.0;
  bool fisheye_ = false;
  std::size_t most_views_ = 60;
  bool dry_run_ = false;
  bool json_ = false;
};

}  // namespace mocap::calibrate
