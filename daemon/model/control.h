#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/time.h"
#include "model/audit.h"
#include "model/calibration/calibration_order.h"
#include "model/calibration/calibration_report.h"
#include "model/description.h"
#include "model/health.h"
#include "model/image_mask.h"
#include "model/snapshot.h"
#include "model/take/take_order.h"

namespace mocap {

enum class ControlAction {
  GetStatus,
  GetDescription,
  GetSnapshot,
  GetShots,
  StartCapture,
  StopCapture,
  AddSubject,     ///< the subject is searched (again)
  RemoveSubject,  ///< the subject is not searched any more
  ResetSubject,   ///< discards the subject's pose and fitted body
  FitSubject,     ///< applies the fitted body of the request
  AdjustCamera,
  LearnMask,
  DrawMasks,    ///< `polygons` of the request replace the drawn masks of the camera
  UndoMasks,    ///< the drawn masks of the camera are those before the last DrawMasks
  ForgetMasks,  ///< discards the learnt masks of the camera
  GetMasks,
  Reload,          ///< reads the configuration again
  Take,            ///< follows the order `take` of the request
  GetCalibration,  ///< the progress of the calibration, or the earlier rigs
  Calibrate,       ///< follows the order `calibration` of the request
};

/// Whether the request reads only.
constexpr bool only_looks(ControlAction action) {
  return action == ControlAction::GetStatus || action == ControlAction::GetDescription ||
         action == ControlAction::GetSnapshot || action == ControlAction::GetShots ||
         action == ControlAction::GetCalibration || action == ControlAction::GetMasks;
}

/// Number of images of each camera from which a mask is learnt, if a request does not say it.
inline constexpr std::uint32_t kDefaultMaskImages = 100;

/// The longest time that cameras have to deliver the images of a LearnMask request: a minute, and 100 ms for each
/// image. A camera of 1.5 Hz delivers kDefaultMaskImages in this time; one of 10 Hz delivers any number.
constexpr Duration longest_learning(std::uint32_t images) {
  return std::chrono::minutes(1) + (images == 0 ? kDefaultMaskImages : images) * std::chrono::milliseconds(100);
}

/// A request of an operator to the running daemon.
struct ControlRequest {
  std::uint64_t number = 0;  ///< names the request in its answer; set by the ControlServer
  ControlAction action = ControlAction::GetStatus;
  std::string name;        ///< name of the subject or camera; empty: all cameras
  std::string marker_set;  ///< AddSubject: absolute path of a new subject's marker set; empty: a configured subject
  std::string marker_set_text;  ///< AddSubject: content of a new subject's marker set file, instead of `marker_set`
  std::optional<double> exposure_us;
  std::optional<double> gain_db;
  std::uint32_t images = 0;                       ///< LearnMask: number of images of each camera; 0: kDefaultMaskImages
  std::vector<MaskPolygon> polygons;              ///< DrawMasks
  std::vector<Eigen::Vector3d> rest_offsets_m;    ///< FitSubject: by bone
  std::vector<Eigen::Vector3d> marker_offsets_m;  ///< FitSubject: by marker
  double residual_m = 0.0;                        ///< FitSubject
  TakeOrder take;                                 ///< Take; its `number` is not used
  CalibrationOrder calibration;                   ///< GetCalibration, Calibrate; its `number` is not used
  AuditActor by;                                  ///< who asks; set by the ControlServer
};

enum class ControlCode { Done, Invalid, NotFound, Forbidden, Unsupported, Timeout, Failed };

/// State of the daemon, in the answer to a status request.
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

/// The masks of one camera.
struct CameraMasks {
  std::string camera;
  int width_px = 0;  ///< of the images; 0: unknown
  int height_px = 0;
  std::vector<MaskPolygon> drawn;
  std::vector<MaskPolygon> learnt;
  std::size_t undo_steps = 0;  ///< number of UndoMasks that are possible
};

/// The answer to a request.
struct ControlAnswer {
  ControlCode code = ControlCode::Done;
  std::string message;  ///< text for the operator
  std::optional<ControlStatus> status;
  const Description* description = nullptr;  ///< borrowed
  const Snapshot* snapshot = nullptr;        ///< borrowed
  std::optional<std::vector<Shot>> shots = std::nullopt;
  const CalibrationReport* calibration = nullptr;  ///< borrowed
  std::optional<std::vector<KeptRig>> rigs = std::nullopt;
  std::optional<std::vector<CameraMasks>> masks = std::nullopt;
};

}  // namespace mocap
