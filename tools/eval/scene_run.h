#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/scoring/labels_score.h"
#include "lib/scoring/skeleton_score.h"
#include "lib/simworld/scene_file.h"

namespace mocap::eval {

/// How one clip of a scene went.
struct SceneOutcome {
  std::string clip;
  std::vector<std::string> subjects;  ///< names, by SubjectId
  std::vector<std::vector<std::string>> marker_names;
  std::vector<std::vector<std::string>> bone_names;
  std::vector<std::vector<bool>> rotation_observability;  ///< by subject and bone: its markers tell its turn
  std::map<std::uint32_t, scoring::LabelCounts> labels;   ///< by subject
  std::map<std::uint32_t, scoring::SkeletonCounts> bones;
  std::map<std::uint32_t, std::map<std::uint32_t, scoring::BoneCounts>> each_bone;
  std::map<std::uint32_t, scoring::Timeline> timelines;  ///< empty unless kept
  std::map<std::uint32_t, std::vector<scoring::JointErrors>> errors;
  std::vector<scoring::WrongEvent> wrong;  ///< names, in the order of their ends
  scoring::ClearMot::Counts mot;
  std::uint64_t sets = 0, unlabelled = 0, ghosts = 0;
  double watched_squares_m2 = 0.0;  ///< of the joints that [[only_camera]] names, while it lasts
  std::uint64_t watched = 0;
  double world_s = 0.0, row_s = 0.0;  ///< what making the blobs took, and what the row took
};

struct SceneRunSettings {
  std::uint64_t seed = 1;
  bool rays = true;  ///< false: [[only_camera]] hides from that one, too
  bool keeps_plots = false;
  std::filesystem::path snapshots = {};  ///< file for every snapshot (.pb or .jsonl); empty: none
};

/// Runs one clip of a scene through the daemon's own row. The same arguments give the same outcome, times aside. Fails
/// with NotFound where a motion is missing, else with what is wrong with a file that the scene names.
Result<SceneOutcome> run_scene(const simworld::SceneFile& scene, const std::string& clip,
                               const SceneRunSettings& settings);

}  // namespace mocap::eval
