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
#include "model/search_health.h"

namespace mocap::eval {

/// The reason why a subject was not found at one instant, as the daemon words it.
struct SearchReason {
  double t_s = 0.0;
  std::uint32_t subject = 0;
  SearchCause cause = SearchCause::None;
  std::string sentence;
};

/// Results of one clip of a scene.
struct SceneOutcome {
  std::string clip;
  std::vector<std::string> subjects;  ///< names, by SubjectId
  std::vector<std::vector<std::string>> marker_names;
  std::vector<std::vector<std::string>> bone_names;
  std::vector<std::vector<bool>> rotation_observability;  ///< by subject and bone: the rotation is fully observable
  std::map<std::uint32_t, scoring::LabelCounts> labels;   ///< by subject
  std::map<std::uint32_t, scoring::SkeletonCounts> bones;
  std::map<std::uint32_t, std::map<std::uint32_t, scoring::BoneCounts>> each_bone;
  std::map<std::uint32_t, scoring::Timeline> timelines;  ///< empty unless keeps_plots
  std::map<std::uint32_t, std::vector<scoring::JointErrors>> errors;
  std::vector<scoring::WrongEvent> wrong;  ///< wrong labels, sorted by the end of the event
  scoring::ClearMot::Counts mot;
  std::vector<SearchReason> reasons;  ///< in the order of time
  std::uint64_t sets = 0, unlabelled = 0, ghosts = 0;
  double watched_squares_m2 = 0.0;  ///< squared errors of the joints of [[only_camera]] during the event
  std::uint64_t watched = 0;
  double world_s = 0.0, pipeline_s = 0.0;  ///< CPU time of the simulation and of the pipeline
};

struct SceneRunSettings {
  std::uint64_t seed = 1;
  bool rays = true;  ///< false: the markers of [[only_camera]] are hidden from that camera too
  bool keeps_plots = false;
  bool offline = false;                  ///< scores the sets tracked again forwards and backwards (lib/offline)
  std::filesystem::path snapshots = {};  ///< output file of all snapshots (.pb or .jsonl); empty: none
};

/// Runs one clip of a scene through the daemon's pipeline. The same arguments give the same outcome, except CPU times.
/// Fails with NotFound if a motion file is missing, and with the error of a file that cannot be used.
Result<SceneOutcome> run_scene(const simworld::SceneFile& scene, const std::string& clip,
                               const SceneRunSettings& settings);

}  // namespace mocap::eval
