#include "calibration/solve_wand.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/hold_out.h"
#include "calibration/join_cameras.h"
#include "calibration/place_wand.h"
#include "calibration/rate_wand.h"
#include "calibration/time_offset.h"
#include "calibration/wand_views.h"

namespace mocap::calibration {
namespace {

// One round of the solution: what is free, how far a spot may lie from where its marker should be, which share of the
// samples takes part.
struct Round {
  LensFreedom lens;
  double gate_px;
  std::size_t most_samples;
  int most_steps;
};

// From coarse to fine. With unknown lenses the first places are off by what the lens bends.
std::vector<Round> rounds_of(const WandSettings& settings) {
  const std::size_t all = static_cast<std::size_t>(settings.most_samples);
  if (settings.lens_known) {
    const LensFreedom lens = settings.refine_lens ? LensFreedom::All : LensFreedom::Fixed;
    return {{LensFreedom::Fixed, 20.0, 400, 30}, {lens, 3.0, 1500, 30}, {lens, 1.5, all, 20}};
  }
  return {{LensFreedom::Focal, 60.0, 400, 60},
          {LensFreedom::Rough, 30.0, 600, 60},
          {LensFreedom::All, 10.0, 1500, 60},
          {LensFreedom::All, 3.0, 1500, 40},
          {LensFreedom::All, 1.5, all, 25}};
}

// A camera whose exposures are further off than this spoils what it sees of anything that moves.
constexpr double kMostLate_s = 1.5e-3;
constexpr double kSure = 6.0;

std::optional<WandRefusal> refuse_time(const std::vector<TimeOffset>& offsets, const Rig& rig) {
  const auto worst = std::ranges::max_element(
      offsets, {}, [](const TimeOffset& offset) { return std::abs(offset.late_s) / std::max(1e-6, offset.sigma_s); });
  if (std::abs(worst->late_s) < std::max(kMostLate_s, kSure * worst->sigma_s)) return std::nullopt;
  const auto camera = static_cast<std::size_t>(worst - offsets.begin());
  return WandRefusal{
      WandFault::NotSynchronous,
      fmt::format("camera '{}': its pictures are about {:.1f} ms {} those of the others; synchronise the cameras "
                  "(a common trigger, or PTP) and take again",
                  rig[camera].name, 1e3 * std::abs(worst->late_s),
                  worst->late_s > 0.0 ? "later than" : "earlier than")};
}

}  // namespace

Result<WandSolution, WandRefusal> solve_wand(const Take& take, const Rig& start, const Wand& wand,
                                             const WandSettings& settings, const Progress& progress) {
  const auto going_on = [&](const char* doing, double share) { return !progress || progress(doing, share); };
  const WandRefusal ended{WandFault::NoSolution, "ended before there was a solution"};
  if (!going_on("looking for the wand", 0.0)) return ended;
  auto views = look_for_wand(take, start, wand, settings);
  if (!views) return views.error();
  const double reach_px = settings.lens_known ? 1.5 : 8.0;
  auto rig = join_cameras(*views, start, wand, settings, reach_px, progress);
  if (!rig) return rig.error();

  Bundle bundle;
  bundle.wand = wand;
  bundle.rig = *std::move(rig);
  const std::vector<Round> rounds = rounds_of(settings);
  for (std::size_t r = 0; r < rounds.size(); ++r) {
    const Round& round = rounds[r];
    place_wand(*views, bundle, {.gate_px = round.gate_px, .most_samples = round.most_samples});
    if (bundle.places.size() < static_cast<std::size_t>(settings.least_samples)) {
      return WandRefusal{WandFault::TooFewSamples,
                         fmt::format("only {} samples agree over two cameras or more, expected {} at least; wave the "
                                     "wand longer, where several cameras see it",
                                     bundle.places.size(), settings.least_samples)};
    }
    BundleSettings adjusting;
    adjusting.lens = round.lens;
    adjusting.outlier_sigmas = 0.5 * round.gate_px / bundle.sights.front().sigma_px;
    adjusting.most_steps = round.most_steps;
    adjusting.threads = settings.threads;
    const bool last = r + 1 == rounds.size();
    if (last) {
      drop_outliers(bundle);
      adjusting.outlier_sigmas = 0.0;
    }
    const auto steps = [&](int step) {
      return going_on("adjusting", (static_cast<double>(r) + static_cast<double>(step) / round.most_steps) /
                                       static_cast<double>(rounds.size()));
    };
    if (!adjust(bundle, adjusting, steps)) {
      return WandRefusal{WandFault::NoSolution,
                         "the cameras and the wand do not explain each other; see that the wand's "
                         "lengths and the lens files are right"};
    }
    if (last && drop_outliers(bundle) > 0 && !adjust(bundle, adjusting, steps)) return ended;
    // Before the gates get narrow and leave out what moves fast.
    if (r + 1 == rounds.size() / 2) {
      if (auto refusal = refuse_time(time_offsets(*views, bundle, 2.0 * round.gate_px), bundle.rig)) return *refusal;
    }
  }
  const std::vector<TimeOffset> offsets = time_offsets(*views, bundle, rounds.back().gate_px);
  WandSolution solution = rate_wand(std::move(bundle), rounds.back().lens);
  if (!going_on("checking", 0.95)) return ended;
  hold_out(solution, rounds.back().lens, settings.threads);
  for (std::size_t c = 0; c < offsets.size(); ++c) {
    solution.cameras[c].late_s = offsets[c].late_s;
    solution.cameras[c].late_sigma_s = offsets[c].sigma_s;
  }
  return solution;
}

}  // namespace mocap::calibration
