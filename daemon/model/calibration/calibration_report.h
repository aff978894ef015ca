#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "model/camera_model.h"

namespace mocap {

/// The image of a camera is divided into kCoverageCells x kCoverageCells cells.
inline constexpr int kCoverageCells = 8;

enum class CalibrationState {
  Idle,        ///< nothing was asked for since the start
  Collecting,  ///< images are collected
  Solving,     ///< a rig is computed
  Solved,      ///< a rig waits for Apply
  Applied,     ///< the rig is in force
  Failed,      ///< `message` has the reason
  Cancelled,
};

/// The progress and the result of one camera.
struct CalibrationCamera {
  std::string name;
  std::uint64_t images = 0;
  std::uint64_t dropped = 0;  ///< images that were not examined because the thread was too slow
  std::uint64_t samples = 0;  ///< images with a detected wand
  std::uint64_t shared = 0;   ///< of these, at instants at which another camera detected the wand, too
  double coverage = 0.0;      ///< fraction of the image cells with a marker
  std::array<std::uint32_t, kCoverageCells * kCoverageCells> cells{};  ///< markers by image cell, row by row
  bool is_connected = false;  ///< shares enough samples with the first camera, directly or through others
  // Of the result; 0 or nothing until there is one.
  double rms_px = 0.0;               ///< per axis
  std::optional<double> heldout_px;  ///< per axis, of samples that the rig was not adjusted to; nothing: unknown
  std::uint64_t points = 0;
  std::optional<double> position_sigma_m;  ///< nothing: the samples do not determine the rig
  std::optional<double> rotation_sigma_rad;
};

/// Facts about a rig, for the table [metadata] of its file.
using RigFacts = std::map<std::string, std::variant<bool, double, std::string>>;

/// A rig that was computed and the facts about it.
struct CalibratedRig {
  Rig rig;
  RigFacts facts;
};

/// The result as a whole.
struct CalibrationResult {
  CalibratedRig calibrated;
  std::string grade;  ///< "excellent", "good", "fair" or "poor"
  double rms_px = 0.0;
  std::optional<double> heldout_px;  ///< nothing: unknown
  std::uint64_t samples = 0;
  double wand_m = 0.0;  ///< mean length, triangulated without the known length; 0: unknown
  double wand_std_m = 0.0;
  /// Of a measured floor: residual of its markers. Nothing if three markers were fitted to a plane, see `issues`, and
  /// for a calibration of the cameras.
  std::optional<double> floor_rms_m;
  bool floor_is_guessed = false;
  std::vector<std::string> issues;  ///< with advice, the worst first
};

/// The progress of a calibration.
struct CalibrationReport {
  std::uint64_t order = 0;  ///< number of the newest order that was followed
  CalibrationState state = CalibrationState::Idle;
  bool is_floor = false;         ///< the floor is measured, not the cameras
  bool is_complete = false;      ///< the images suffice
  std::string advice;            ///< to the operator who waves the wand; empty: none
  std::uint64_t min_shared = 0;  ///< shared samples that each camera needs
  std::string step;              ///< of the solution
  double fraction = 0.0;         ///< of it that is done
  std::string message;           ///< why the calibration failed or was cancelled
  std::vector<CalibrationCamera> cameras;
  std::optional<CalibrationResult> result;
};

/// An earlier rig that the daemon keeps.
struct KeptRig {
  std::string name;
  std::string solved_at_utc;  ///< empty: unknown
  std::string solved_by;      ///< empty: unknown
  std::uint32_t cameras = 0;
  double rms_px = 0.0;    ///< 0: unknown
  bool in_force = false;  ///< has the same bytes as the rig file in force
};

}  // namespace mocap
