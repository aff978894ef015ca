#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "base/log.h"
#include "base/result.h"
#include "cameras/camera_settings.h"
#include "detect/blob_detector.h"
#include "drift/drift_watch.h"
#include "label/body_labeller.h"
#include "model/camera_model.h"
#include "model/ids.h"
#include "model/skeleton.h"
#include "runtime/pipeline.h"
#include "settings/faults.h"
#include "settings/subject_keeper.h"
#include "solve/subject_refiner.h"
#include "solve/tree_solver.h"
#include "track2d/following_blob_tracker.h"
#include "track3d/kalman_marker_tracker.h"
#include "wire/zmq_control.h"
#include "wire/zmq_publisher.h"

namespace mocap::settings {

/// [capture]: the run as a whole.
struct CaptureSettings {
  std::filesystem::path rig_file;
  double rate_hz = 0.0;  ///< sets a second that clients are told to expect; 0: the fastest camera's rate
};

/// [[subject]]
struct SubjectSettings {
  std::string name;
  std::filesystem::path marker_set_file;
  std::filesystem::path file;  ///< of the body as it was fitted before; empty: it is fitted when it is recognised
  std::filesystem::path keep;  ///< where fits made while the daemon runs are kept; read at start where there is one
};

/// [record]: what is kept of a run.
struct RecordSettings {
  std::filesystem::path snapshots;  ///< every snapshot, as .jsonl or .pb; empty: not kept
  std::filesystem::path blobs;      ///< what every camera's detector finds, as .blobs; empty: not kept
};

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
  drift::DriftSettings drift;  ///< [watch]; drift_px 0: off
  wire::PublisherSettings publish;
  wire::ControlSettings control;  ///< endpoint empty: beside the feed; "none": nobody is listened to
  RecordSettings record;
  runtime::PipelineSettings pipeline;  ///< [capture], [align], [publish], [reopen], [queues], [realtime]
  bool lock_memory = false;

  Rig rig;                           ///< by CameraId: the rig file's entry of each camera
  std::vector<Subject> worn;         ///< by SubjectId: each subject with its marker set
  std::vector<KeptSubject> kept;     ///< whose fits are kept
  std::vector<MarkerSet> simulated;  ///< by CameraId: what a synthetic camera's subject wears; empty for the others
  double nominal_rate_hz = 0;        ///< capture.rate_hz, or what follows from the cameras; 0: nobody says
};

/// Whether a configuration goes without the rig that it names.
enum class RigNeed {
  Whole,    ///< it has every camera
  AsFound,  ///< for whoever makes it: a camera that is in no rig file is one of its name alone, of size 0
};

/// Reads and checks a configuration with the rig and the marker sets that it names. Fails with all that is wrong.
Result<DaemonSettings, Faults> load_daemon_settings(const std::filesystem::path& path, RigNeed need = RigNeed::Whole);

/// [detect] with what the camera's own table says instead.
detect::DetectSettings detect_of(const DaemonSettings& settings, CameraId camera);

/// What is in force, as pairs of "align.window_us" and "500"; those of a camera as "camera.north-east.driver". What is
/// absent is left out.
std::vector<std::pair<std::string, std::string>> list_settings(const DaemonSettings& settings);

}  // namespace mocap::settings
