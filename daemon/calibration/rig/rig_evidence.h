#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calibration/floor/floor.h"
#include "calibration/wand/solve_wand.h"

namespace mocap::calibration {

/// The data by which a rig is assessed; unknown data is empty.
struct RigEvidence {
  Rig rig;                                     ///< in the world frame of the report
  std::vector<ObservationResidual> residuals;  ///< camera: index in the rig
  std::vector<double> lengths_m;               ///< of the wand, triangulated without its known length
  double nominal_length_m = 0.0;               ///< of the wand; 0: there was no wand
  std::vector<Eigen::Vector3d> points_m;       ///< positions of markers: they define the volume
  Eigen::MatrixXd covariance;                  ///< as in RigCovariance, in world axes
  bool floor_is_measured = false;              ///< the world frame has its z = 0 on a measured floor
  std::vector<std::string> unsynchronised;     ///< names of cameras whose synchronisation was not checked
};

/// The evidence of a wand calibration. The world is that of `floor`, a measured one; without a floor, z is the normal
/// of the plane through the camera centres, which is about vertical.
RigEvidence evidence_of(const WandSolution& solution, const std::optional<Floor>& floor);

}  // namespace mocap::calibration
