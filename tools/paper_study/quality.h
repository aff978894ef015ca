#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "paper_study/clip.h"

namespace mocap::paper_study {

/// The errors of a method's predictions in the clips of a situation, px. The study's way: only clips without a loss
/// count, and the limits are those of the mean's 99 % confidence interval by the central limit theorem.
struct ErrorFigures {
  std::uint64_t samples = 0;
  double low = 0.0;
  double mean = 0.0;
  double high = 0.0;
  double mean_all = 0.0;  ///< over all clips, lost ones included
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
  int clips = 20;  ///< of each situation
  std::uint64_t seed_base = 1;
};

/// Draws the clips of these situations and runs every method on each. `progress` is told how many clips are done.
std::vector<SituationQuality> judge(const QualitySettings& settings, std::span<const Situation> situations,
                                    const std::function<void(int done)>& progress);

}  // namespace mocap::paper_study
