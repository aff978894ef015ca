#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "paper_study/clip.h"
#include "paper_study/cost.h"
#include "paper_study/quality.h"

namespace mocap::paper_study {

// Figures published in: Queiroz, Gomide, de Albuquerque Araujo, "Evaluation of real time tracking methods for an open
// source motion capture system".

/// The methods of the study, in the order of its tables.
inline constexpr std::array kStudyMethods{"alpha_beta", "kalman", "condensation"};

/// Table I: losses in 20 clips. Empty for our own situations.
std::optional<int> published_losses(Situation situation, std::size_t method);

/// Tables II to IV, px, with 99 % limits. The published mean excludes lost clips, so `mean_all` is unknown (0).
std::optional<ErrorFigures> published_errors(Situation situation, std::size_t method);

/// Results of the study's own code on clips with the laws of make_clip(): losses in 20 clips and their standard
/// deviation over 10 runs, and the mean error of the clips without a loss (0 if unknown).
struct OriginalCode {
  double losses;
  double deviation;
  double error_px;
};
std::optional<OriginalCode> original_code(Situation situation, std::size_t method);

/// Tables V to VII, on the hardware of the study.
std::span<const CostRow> published_costs(std::size_t method);

}  // namespace mocap::paper_study
