#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "paper_study/clip.h"

namespace mocap::paper_study {

/// Prediction errors of a method in the clips of a situation, px. As in the study, only clips without a loss count, and
/// the limits are the 99 % confidence interval of the mean by the central limit theorem.
struct ErrorFigures {
  std::uint64_t samples = 0;
  double low = 0.0;
  double mean = 0.0;
  double high = 0.0;
  double mean_all = 0.0;  ///< over all clips, including lost ones
};

ErrorFigures figures_of(std::span<const double> kept_px, std::span<const double> all_px);

struct MethodQuality {
  std::string method;
  int losses = 0;
  ErrorFigures error_px;
};

struct SituationQuality {
  Situation situation;
  std::vector<MethodQuality> methods;
};

struct QualitySettings {
  int clips = 20;  ///< clips of each situation
  std::uint64_t seed_base = 1;
};

/// Generates the clips of these situations and runs every method on each clip. Calls `progress` with the number of
/// finished clips.
std::vector<SituationQuality> judge(const QualitySettings& settings, std::span<const Situation> situations,
                                    const std::function<void(int done)>& progress);

}  // namespace mocap::paper_study
