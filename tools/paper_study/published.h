#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "paper_study/clip.h"
#include "paper_study/cost.h"
#include "paper_study/quality.h"

namespace mocap::paper_study {

// What the study printed: Queiroz, Gomide, de Albuquerque Araujo, "Evaluation of real time tracking methods for an open
// source motion capture system".

/// Its methods, in the order of its tables.
inline constexpr std::array kStudyMethods{"alpha_beta", "kalman", "condensation"};

/// Table I: losses of 20 clips; none for situations that are ours.
std::optional<int> published_losses(Situation situation, std::size_t method);

/// Tables II to IV, px, with 99 % limits; the published mean leaves lost clips out, and so `mean_all` is not told (0).
std::optional<ErrorFigures> published_errors(Situation situation, std::size_t method);

/// The study's own code, run on clips drawn by the laws that make_clip follows: losses of 20 and their standard
/// deviation over 10 runs, and the mean error of the clips that it did not lose (0 where none was told).
struct OriginalCode {
  double losses;
  double deviation;
  double error_px;
};
std::optional<OriginalCode> original_code(Situation situation, std::size_t method);

/// Tables V to VII, on the hardware of the study.
std::span<const CostRow> published_costs(std::size_t method);

}  // namespace mocap::paper_study
