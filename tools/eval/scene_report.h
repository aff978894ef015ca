#pragma once

#include <optional>
#include <string>
#include <vector>

#include "eval/scene_run.h"
#include "lib/simworld/scene_file.h"

namespace mocap::eval {

/// Results of a scene: one run for each clip and, if the scene has [[only_camera]], a second run without those
/// single-camera views.
struct SceneResults {
  std::vector<SceneOutcome> clips;
  std::vector<SceneOutcome> without_rays;  ///< by clip; empty if not run
  std::vector<std::string> skipped;        ///< clips whose motion file is missing
};

/// One figure of [goal] and its value: over all clips for reacquired_share, exchanges and ray_gain, otherwise of the
/// worst clip.
struct GoalMet {
  std::string key;
  double goal = 0.0;
  std::optional<double> value;
  bool met = false;
};
std::vector<GoalMet> goals_of(const simworld::SceneFile& scene, const SceneResults& results);

/// One JSON object in one line: the figures of all clips together, "worst", "clips" with "subjects", "goals".
std::string to_json(const simworld::SceneFile& scene, const SceneResults& results);

/// Text for a terminal: one line for each clip and subject, the total, the goals.
std::string to_text(const simworld::SceneFile& scene, const SceneResults& results);

/// Lists at most `most` wrong-label events of each clip, one line each, longest first.
std::string wrong_text(const SceneResults& results, std::size_t most);

/// Lists the reasons why a subject was not found, one line each: clip, time, sentence.
std::string reasons_text(const SceneResults& results);

}  // namespace mocap::eval
