#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model/camera_model.h"
#include "model/skeleton.h"
#include "model/subject_state.h"

namespace mocap {

/// The names and constants that snapshots refer to by index. Changes rarely; each change increments the version.
struct Description {
  std::uint32_t version = 1;
  std::string producer;    ///< program and version
  std::string session_id;  ///< id of this run of the daemon
  double nominal_rate_hz = 0.0;
  Rig cameras;
  std::vector<double> camera_rates_hz;  ///< nominal, by CameraId; 0: unknown. Empty: of no camera
  std::vector<Subject> subjects;
};

/// Returns the description with the bone lengths, marker offsets and version of a fit.
Description with_fit(Description description, const SubjectFit& fit);

}  // namespace mocap
