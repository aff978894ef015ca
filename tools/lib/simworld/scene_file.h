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

/// [[actor]]: somebody in the volume, whom the daemon knows as a subject of the same name.
struct SceneActor {
  std::string name;
  std::string motion;                ///< a BVH or C3D file, or acts as "walk:5,wave"; empty: the clip's
  std::filesystem::path marker_set;  ///< as the daemon is told it
  double t_pose_s = 2.0;             ///< before a BVH begins; it takes another second to get into it
  double arms_lowered_deg = 0.0;     ///< meanwhile: 0 is T-pose, 45 A-pose
  std::array<double, 2> place_m{0.0, 0.0};
  double heading_deg = 0.0;  ///< the motion turned, counter-clockwise
  double delay_s = 0.0;
  double size = 1.0;             ///< of the body, times that of the marker set
  double marker_error_mm = 0.0;  ///< markers sit that far from where the marker set says, standard deviation each axis
  bool stored = false;           ///< the daemon knows body and markers as they are, as from a subject file
  std::string fit;               ///< a static C3D trial that the subject is fitted to first
};

/// [[blackout]]: all cameras are blind.
struct SceneBlackout {
  double first_s = 4.0;
  double for_s = 1.0;
  int times = 1;
  double gap_min_s = 2.0;  ///< from the end of one to the beginning of the next
  double gap_max_s = 3.0;
};

/// [[hide]]: markers are hidden from all cameras at random, a time each.
struct SceneHide {
  double from_s = 3.0;
  double to_s = 1e9;
  double share = 0.3;  ///< of the markers, at any time
  double for_s = 0.5;
};

/// [[only_camera]]: markers of one actor that one camera alone sees, and others that none sees.
struct SceneOnlyCamera {
  std::string actor;    ///< empty: the first
  std::string markers;  ///< names with blanks between
  std::string hidden;   ///< likewise
  std::string bone;     ///< whose joint is judged meanwhile
  int camera = 1;       ///< of the rig, from 1
  double from_s = 5.0;
  double for_s = 1.0;
  int times = 1;
  double gap_s = 1.5;  ///< from the end of one to the beginning of the next
};

/// [goal]: what is asked for; absent: nothing.
struct SceneGoal {
  std::optional<double> f1, availability, longest_wrong_sets, joint_rms_mm, rotation_rms_deg, reacquired_share,
      hidden_joint_rms_mm, exchanges, ray_gain;
};

/// A scene and how it is judged, as its file tells it.
struct SceneFile {
  std::filesystem::path path;
  std::string about;
  double seconds = 12.0;  ///< of each clip
  double rate_hz = 120.0;
  std::uint64_t seed = 1;
  scene::Ring ring;
  std::filesystem::path rig_file;  ///< empty: the ring
  double marker_diameter_mm = 15.0;
  double noise = 1.0;              ///< of blobs, times the detector's
  double false_blobs = 0.02;       ///< for each blob of a marker
  bool occlusion = true;           ///< bodies hide markers
  bool drawn = false;              ///< images are drawn and the detector looks at them, which takes ten times as long
  std::vector<std::string> clips;  ///< the scene is run with each, for the actors without a motion
  std::vector<SceneActor> actors;
  std::vector<SceneBlackout> blackouts;
  std::vector<SceneHide> hides;
  std::vector<SceneOnlyCamera> only_camera;
  SceneGoal goal;
  settings::DaemonSettings daemon;  ///< of which the stages' sections may be told, as in mocapd.toml
};

/// Reads and checks a scene (config/scenes). Fails with all that is wrong, file, line and column.
Result<SceneFile, settings::Faults> load_scene(const std::filesystem::path& path);

/// Where a motion lies: beside the scene's file, else in the folder that MOCAP_SHARED_DATA names, else in the
/// `shared/data` nearest above the scene's file. Fails with NotFound, which names all places.
Result<std::filesystem::path> find_motion(const SceneFile& scene, const std::string& motion);

}  // namespace mocap::simworld
