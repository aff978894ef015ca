#pragma once

#include <string>
#include <vector>

#include "eval/scene_run.h"
#include "lib/simworld/scene_file.h"

namespace mocap::eval {

/// A scene's results: a run a clip, and, where [[only_camera]] asks for it, the same without the rays.
struct SceneResults {
  std::vector<SceneOutcome> clips;
  std::vector<SceneOutcome> without_rays;  ///< by clip; empty: not run
  std::vector<std::string> skipped;        ///< clips that are not there
};

/// What [goal] asks for, and what came out: of the worst clip, or (reacquired_share, exchanges, ray_gain) of all.
struct GoalMet {
  std::string key;
  double goal = 0.0;
  std::optional<double> value;
  bool met = false;
};
std::vector<GoalMet> goals_of(const simworld::SceneFile& scene, const SceneResults& results);

/// One JSON object in one line: all clips together, "worst" of each figure, "clips" with "subjects", "goals".
std::string to_json(const simworld::SceneFile& scene, const SceneResults& results);

/// For people: a line a clip and subject, the sum, the goals.
std::string to_text(const simworld::SceneFile& scene, const SceneResults& results);

/// The wrong names, a line each, the longest of each clip first, `most` a clip.
std::string wrong_text(const SceneResults& results, std::size_t most);

}  // namespace mocap::eval
