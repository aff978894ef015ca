#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "scene/ring_rig.h"
#include "settings/daemon_settings.h"

namespace mocap::simworld {

/// [[actor]]: a person in the volume. The daemon has a subject of the same name.
struct SceneActor {
  std::string name;
  std::string motion;                ///< a BVH or C3D file, or acts such as "walk:5,wave"; empty: the clip
  std::filesystem::path marker_set;  ///< marker set file of the daemon's subject
  double t_pose_s = 2.0;          ///< duration of the T-pose before a BVH motion; the transition takes another second
  double arms_lowered_deg = 0.0;  ///< during that pose: 0 is a T-pose, 45 an A-pose
  std::array<double, 2> place_m{0.0, 0.0};
  double heading_deg = 0.0;  ///< rotation of the motion about z, counter-clockwise
  double delay_s = 0.0;
  double size = 1.0;             ///< size of the body relative to the marker set
  double marker_error_mm = 0.0;  ///< standard deviation of the marker offsets from the marker set, each axis
  bool stored = false;           ///< the daemon has the true body and marker offsets, as from a subject file
  std::string fit;               ///< a static C3D trial to which the subject is fitted first
};

/// [[blackout]]: no camera sees anything.
struct SceneBlackout {
  double first_s = 4.0;
  double for_s = 1.0;
  int times = 1;
  double gap_min_s = 2.0;  ///< from the end of a blackout to the start of the next
  double gap_max_s = 3.0;
};

/// [[image_loss]]: no camera delivers an image, as when the machine or the network stalls. Then the cameras return one
/// by one.
struct SceneImageLoss {
  double first_s = 4.0;
  double for_min_s = 0.05;
  double for_max_s = 1.0;
  double return_s = 0.2;  ///< each camera returns at a random time within this time after the loss
  int times = 1;
  double gap_s = 2.0;  ///< from the end of a loss to the start of the next
};

/// [[hide]]: random markers are hidden from all cameras.
struct SceneHide {
  double from_s = 3.0;
  double to_s = 1e9;
  double share = 0.3;        ///< expected share of hidden markers
  double for_s = 0.5;        ///< median of the time for which a marker is hidden
  double for_p90_s = 0.0;    ///< its 90th percentile, of a log-normal distribution; 0: always for_s
  std::string markers = {};  ///< names separated by spaces; empty: all markers
};

/// [[only_camera]]: markers of one actor that only one camera sees, and markers that no camera sees.
struct SceneOnlyCamera {
  std::string actor;    ///< empty: the first actor
  std::string markers;  ///< names separated by spaces
  std::string hidden;   ///< names separated by spaces
  std::string bone;     ///< the joint of this bone is scored during the event
  int camera = 1;       ///< number in the rig, from 1
  double from_s = 5.0;
  double for_s = 1.0;
  int times = 1;
  double gap_s = 1.5;  ///< from the end of an event to the start of the next
};

/// [goal]: required figures of the scene. An absent figure has no requirement.
struct SceneGoal {
  std::optional<double> f1, availability, longest_wrong_sets, joint_rms_mm, rotation_rms_deg, reacquired_share,
      hidden_joint_rms_mm, exchanges, ray_gain;
};

/// [score]: what is scored.
struct SceneScore {
  std::string below =
      {};  ///< bones, separated by spaces: only the bones below them, with their markers; empty: everything
};

/// Content of a scene file.
struct SceneFile {
  std::filesystem::path path;
  std::string about;
  double seconds = 12.0;  ///< duration of each clip
  double rate_hz = 120.0;
  std::uint64_t seed = 1;
  scene::Ring ring;
  std::filesystem::path rig_file;  ///< empty: use `ring`
  double marker_diameter_mm = 15.0;
  double noise = 1.0;         ///< centroid noise relative to the detector's
  double false_blobs = 0.02;  ///< expected number for each blob of a marker
  bool occlusion = true;      ///< bodies hide markers
  bool drawn = false;         ///< draw images and run the detector on them, which takes ten times as long
  std::vector<std::string>
      clips;  ///< the scene runs once with each clip, which is the motion of the actors without a motion
  std::vector<SceneActor> actors;
  std::vector<SceneBlackout> blackouts;
  std::vector<SceneImageLoss> image_losses;
  std::vector<SceneHide> hides;
  std::vector<SceneOnlyCamera> only_camera;
  SceneGoal goal;
  SceneScore score;
  settings::DaemonSettings
      daemon;  ///< the scene file may contain the sections of the pipeline steps, as in mocapd.toml
};

/// Reads and checks a scene file (config/scenes). Fails with all faults, each with file, line and column.
Result<SceneFile, settings::Faults> load_scene(const std::filesystem::path& path);

/// Finds a motion file: next to the scene file, else in the folder of the environment variable MOCAP_SHARED_DATA, else
/// in the closest `shared/data` above the scene file. Fails with NotFound and the list of these places.
Result<std::filesystem::path> find_motion(const SceneFile& scene, const std::string& motion);

}  // namespace mocap::simworld
