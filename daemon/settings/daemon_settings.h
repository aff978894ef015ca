#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "associate/match_settings.h"
#include "associate/triangulate_settings.h"
#include "audit/audit_settings.h"
#include "base/key_visitor.h"
#include "base/log.h"
#include "base/result.h"
#include "cameras/camera_settings.h"
#include "cameras/ptp/ptp_settings.h"
#include "detect/detect_settings.h"
#include "drift/drift_settings.h"
#include "label/label_settings.h"
#include "model/camera_model.h"
#include "model/ids.h"
#include "model/skeleton.h"
#include "runtime/runtime_settings.h"
#include "settings/faults.h"
#include "settings/state_folder.h"
#include "settings/subject/kept_subject.h"
#include "solve/refine_settings.h"
#include "solve/solve_settings.h"
#include "take/recordings/record_settings.h"
#include "take/takes_settings.h"
#include "timecode/timecode_settings.h"
#include "track2d/track_blobs_settings.h"
#include "track3d/track_markers_settings.h"
#include "trigger/trigger_settings.h"
#include "wire/wire_settings.h"

namespace mocap::settings {

/// [capture]: the run as a whole. Help and ranges of the keys: daemon_settings.cpp.
struct CaptureSettings {
  std::filesystem::path rig_file;  ///< that of the state folder, if the daemon was calibrated by requests
  bool needs_rig = true;
  double rate_hz = 0.0;
};

/// [[subject]]. Help of the keys: daemon_settings.cpp.
struct SubjectSettings {
  std::string name;
  std::filesystem::path marker_set_file;
  std::filesystem::path file;  ///< empty: the body is fitted when it is recognised
  std::filesystem::path keep;  ///< empty: fits are not kept
};

void declare_keys(KeyVisitor& keys, CaptureSettings& capture);
void declare_keys(KeyVisitor& keys, SubjectSettings& subject);

/// One configuration file and the files that it names, checked.
struct DaemonSettings {
  CaptureSettings capture;
  LogLevel log_level = LogLevel::Info;
  std::vector<cameras::CameraSettings> cameras;  ///< by CameraId
  std::vector<SubjectSettings> subjects;         ///< by SubjectId
  detect::DetectSettings detect;
  track2d::TrackBlobsSettings track_blobs;
  associate::MatchSettings match;
  associate::TriangulateSettings triangulate;
  track3d::TrackMarkersSettings track_markers;
  label::LabelSettings label;
  solve::SolveSettings solve;
  solve::RefineSettings refine;
  drift::DriftSettings drift;
  wire::PublisherSettings publish;
  wire::ControlSettings control;
  wire::NodeSettings node;
  take::RecordSettings record;
  take::TakesSettings takes;
  trigger::TriggerSettings trigger;
  timecode::TimecodeSettings timecode;
  cameras::PtpSettings ptp;
  audit::AuditSettings audit;
  runtime::PipelineSettings pipeline;

  std::filesystem::path file;           ///< of this configuration
  StateFiles state;                     ///< read after it
  Rig rig;                              ///< by CameraId: the entry of each camera in the rig file
  std::vector<Subject> subject_models;  ///< by SubjectId: each subject with its marker set
  std::vector<MarkerSet> definitions;   ///< by SubjectId: the marker set without a body that the daemon keeps
  std::vector<KeptSubject> kept;        ///< subjects whose fits are kept
  std::vector<MarkerSet> simulated;  ///< by CameraId: of the subject that a simulated camera sees; empty for the others
  std::string server_public_key;     ///< of [security] server_key, set by the program that loads it; empty: no keys
  double nominal_rate_hz = 0;        ///< capture.rate_hz, or the rate of the fastest camera; 0: unknown
  std::vector<std::string> state_notes;  ///< what the state files changed, and what of them was left out; for the log
};

/// Whether every camera of a configuration must be in its rig file.
enum class RigNeed {
  Whole,    ///< yes
  AsFound,  ///< no: a camera without an entry gets a model with its name and size 0; for programs that calibrate
};

/// Reads and checks a configuration with the rig and the marker sets that it names, then the state files: added
/// subjects and masks. A subject of the configuration hides an added subject of the same name. Relative names of
/// files that the daemon writes (recordings, kept fits) are in the state folder, without one beside the configuration.
/// Fails with all faults.
Result<DaemonSettings, Faults> load_daemon_settings(const std::filesystem::path& path, const StateFiles& state,
                                                    RigNeed need = RigNeed::Whole);
/// The same without state files.
Result<DaemonSettings, Faults> load_daemon_settings(const std::filesystem::path& path, RigNeed need = RigNeed::Whole);

/// [detect], with the thresholds of the camera's own table.
detect::DetectSettings detect_of(const DaemonSettings& settings, CameraId camera);

/// The values in force as pairs of "align.window_us" and "500"; those of a camera as "camera.north-east.driver". Absent
/// values are left out.
std::vector<std::pair<std::string, std::string>> list_settings(const DaemonSettings& settings);

}  // namespace mocap::settings
