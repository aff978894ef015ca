#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calibration/wand/wand.h"
#include "calibration/wand/wand_recording.h"
#include "model/camera_model.h"

namespace mocap::calibration {

struct WandWatchSettings {
  bool lens_known = true;
  std::size_t enough_samples = 300;                   ///< of each camera, with another camera at once
  double enough_coverage = 0.5;                       ///< share of the fields of its image
  std::size_t settled_samples = 1200;                 ///< with so many, what is not covered lies where nobody can wave
  Duration most_skew = std::chrono::milliseconds(5);  ///< pictures of one instant lie no further apart
};

/// What a camera has seen so far of a wand that is waved.
struct WandSeen {
  std::size_t pictures = 0;
  std::size_t samples = 0;  ///< pictures with the wand
  std::size_t shared = 0;   ///< of these, at an instant when another camera saw it, too
  double coverage = 0.0;    ///< share of its image's 8 x 8 fields that a marker was in
  std::string missing;      ///< the part of its image that is emptiest, in words; empty where none is
  bool joined = false;      ///< it shares samples with the cameras before it, directly or over others
};

/// Follows a take while it is made, and says what is missing. It sees less than solve_wand does: what it calls enough
/// is a take that is worth solving.
class WandWatch {
 public:
  /// The rig gives image sizes and lenses.
  WandWatch(Rig rig, Wand wand, const WandWatchSettings& settings);

  /// The pictures of one camera come in the order of their exposure, those of different cameras in any order.
  void add(std::size_t camera, const Picture& picture);

  WandSeen seen(std::size_t camera) const;
  bool enough() const;
  /// The first thing that is missing, for whoever waves: names a camera and what to do. Empty when there is enough.
  std::string advice() const;

 private:
  static constexpr int kFields = 8;

  struct Camera {
    std::size_t pictures = 0;
    std::size_t shared = 0;
    std::vector<std::pair<Timestamp, bool>> seen;  // exposures with the wand, and whether another camera shares them
    std::array<std::uint32_t, kFields * kFields> fields{};
  };

  bool is_enough(const WandSeen& camera) const;
  std::vector<bool> joined() const;

  Rig rig_;
  Wand wand_;
  WandWatchSettings settings_;
  WandShape shape_;
  std::vector<Camera> cameras_;
  std::vector<std::size_t> pairs_;  // by camera and camera: instants that both saw
  std::vector<Eigen::Vector2d> flat_;
  std::vector<std::size_t> index_;
};

}  // namespace mocap::calibration
