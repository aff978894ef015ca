#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap {

enum class ControlAction {
  GetStatus,
  GetDescription,
  GetSnapshot,
  StartCapture,
  StopCapture,
  AddSubject,     ///< it is looked for (again)
  RemoveSubject,  ///< it is away
  ResetSubject,   ///< where it is and how it measures is forgotten
  FitSubject,     ///< it measures as the request says
  AdjustCamera,
  LearnMask,
  Reload,  ///< the configuration
};

/// Whether it only looks.
constexpr bool only_looks(ControlAction action) {
  return action == ControlAction::GetStatus || action == ControlAction::GetDescription ||
         action == ControlAction::GetSnapshot;
}

/// What somebody asks of the running daemon.
struct ControlRequest {
  ControlAction action = ControlAction::GetStatus;
  std::string name;        ///< of the subject or camera; empty: all cameras
  std::string marker_set;  ///< AddSubject: the absolute path of what a new one wears; empty: it is configured
  std::optional<double> exposure_us;
  std::optional<double> gain_db;
  std::uint32_t images = 0;                       ///< of each camera, to learn a mask from
  std::vector<Eigen::Vector3d> rest_offsets_m;    ///< FitSubject: by bone
  std::vector<Eigen::Vector3d> marker_offsets_m;  ///< FitSubject: by marker
  double residual_m = 0.0;                        ///< FitSubject
};

enum class ControlCode { Done, Invalid, NotFound, Forbidden, Unsupported, Timeout, Failed };

/// How the daemon is, for who asks.
struct ControlStatus {
  std::string producer;
  std::string session_id;
  bool capturing = true;
  std::optional<Health> health;
  struct OneSubject {
    std::string name;
    SubjectPhase phase = SubjectPhase::Searching;
    bool away = false;
  };
  std::vector<OneSubject> subjects;
};

/// What became of it.
struct ControlAnswer {
  ControlCode code = ControlCode::Done;
  std::string message;  ///< for people
  std::optional<ControlStatus> status;
  const Description* description = nullptr;  ///< borrowed
  const Snapshot* snapshot = nullptr;        ///< borrowed
};

}  // namespace mocap
