#pragma once

#include <functional>
#include <string>
#include <vector>

#include "lib/scoring/frames.h"
#include "model/blob.h"
#include "settings/daemon_settings.h"

namespace mocap::metamorphic {

/// The input of the pipeline: a configuration and the images of all cameras in the order of their arrival.
struct Recording {
  settings::DaemonSettings settings;
  std::vector<BlobFrame> frames;
};

/// The output: each snapshot as bytes, without what depends on the cameras' own numbers, and its labels and bones.
struct Answer {
  std::vector<std::string> bytes;
  std::vector<scoring::EvalFrame> frames;
};

/// The three scenes: one walker, two people of different marker sets, and one person with hidden markers.
inline constexpr int kScenes = 3;

/// The recording of a scene, simulated once.
const Recording& recording_of(int scene);
/// The answer to it, computed once.
const Answer& answer_to_scene(int scene);

/// Runs the pipeline of a replay: alignment without patience, 2D tracks, fusion. `sets_per_fusion`: after so many sets
/// a new fusion takes over the belief; 0: one fusion makes all steps.
Answer answer_to(const Recording& recording, std::size_t sets_per_fusion = 0);

/// Maps an answer to the original recording to the expected answer to the changed one.
struct Mapping {
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> position = [](const Eigen::Vector3d& at) { return at; };
  std::function<std::uint32_t(std::uint32_t subject)> subject = [](std::uint32_t same) { return same; };
  std::function<std::uint32_t(std::uint32_t subject, std::uint32_t marker)> marker =
      [](std::uint32_t, std::uint32_t same) { return same; };
};

/// The difference of two answers after the mapping.
struct Difference {
  double markers_rms_m = 0.0;  ///< of the labels that both have
  double bones_rms_m = 0.0;
  double others = 0.0;  ///< share of the labels that only one of them has
};
Difference difference_of(const Answer& original, const Answer& changed, const Mapping& mapping = {});

}  // namespace mocap::metamorphic
