#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "calibrate/lens_views.h"
#include "calibrate/terminal.h"
#include "calibration/lens/fit_lens.h"
#include "lib/cli/app.h"
#include "settings/daemon_settings.h"

namespace mocap::calibrate {

/// The subcommand `lens` of mocap-calibrate: intrinsic calibration with a chessboard or a ChArUco board.
class LensCommand {
 public:
  void add(cli::App& app);
  /// The exit code; nothing if the command line does not have the subcommand.
  std::optional<int> run();

 private:
  /// The views of one camera.
  struct CameraViews {
    std::string name;
    LensViews views;
  };

  int run_lens();
  Result<std::vector<CameraViews>, Failure> see_boards(const calibration::BoardFinder& finder);
  std::optional<Failure> fault_of_output() const;
  Result<std::vector<CameraViews>, Failure> read_folders(const calibration::BoardFinder& finder) const;
  Result<std::vector<CameraViews>, Failure> run_cameras_live(const settings::DaemonSettings& settings,
                                                             const calibration::BoardFinder& finder) const;
  bool is_selected(const std::string& camera) const;
  void keep_selected(settings::DaemonSettings& settings) const;
  int fit_and_write(const std::vector<CameraViews>& cameras);

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
