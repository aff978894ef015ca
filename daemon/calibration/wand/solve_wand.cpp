#include "calibration/wand/solve_wand.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "calibration/wand/hold_out.h"
#include "calibration/wand/join_cameras.h"
#include "calibration/wand/place_wand.h"
#include "calibration/wand/rate_wand.h"
#include "calibration/wand/time_offset.h"
#include "calibration/wand/wand_views.h"

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

// Of the markers that a camera sees of the wand, where the others say that it was: with less it goes with no other.
constexpr double kLeastAgreeing = 0.3;

// A camera that was joined by chance: what it sees is not where the solution puts it.
std::optional<WandRefusal> refuse_odd(const WandViews& views, const Bundle& bundle, const WandSettings& settings,
                                      double reach_px) {
  std::vector<std::size_t> agreeing(bundle.rig.size(), 0);
  std::vector<std::size_t> all(bundle.rig.size(), 0);
  std::vector<int> instants(bundle.places.size(), -1);
  for (const Sight& sight : bundle.sights) {
    ++agreeing[static_cast<std::size_t>(sight.camera)];
    instants[static_cast<std::size_t>(sight.place)] = sight.picture;
  }
  for (const int instant : instants) {
    for (std::size_t c = 0; c < bundle.rig.size() && instant >= 0; ++c)
      all[c] += views.of[c][static_cast<std::size_t>(instant)] ? bundle.wand.marks_m.size() : 0;
  }
  for (std::size_t c = 0; c < bundle.rig.size(); ++c) {
    if (static_cast<double>(agreeing[c]) >= kLeastAgreeing * static_cast<double>(all[c])) continue;
    if (auto mirrored = refuse_mirrored(views, bundle.rig, c, bundle.wand, settings, reach_px)) return mirrored;
    return WandRefusal{
        WandFault::NoOverlap,
        fmt::format("camera '{}': only {} of {} markers that it saw of the wand are where the other cameras "
                    "say; see that its lens file is right and that it is synchronised, and wave where it "
                    "and others look",
                    bundle.rig[c].name, agreeing[c], all[c])};
  }
  return std::nullopt;
}

// Real wands are made to half a millimetre.
constexpr double kMostOff_m = 2e-3;

std::optional<WandRefusal> refuse_marks(const Bundle& bundle) {
  const std::vector<double> measured = measured_marks_m(bundle);
  const std::vector<double>& told = bundle.wand.marks_m;
  if (measured.size() != 3 || std::abs(measured[1] - told[1]) <= kMostOff_m) return std::nullopt;
  return WandRefusal{
      WandFault::WrongWand,
      fmt::format(
          "the wand's middle marker is at {:.0f} mm of {:.0f}, told was {:.0f}; say the distances of yours, from "
          "one end, with --wand",
          1e3 * measured[1], 1e3 * measured[2], 1e3 * told[1])};
}

constexpr const char* kEnded = "ended before there was a solution";

// Places by the round's gate, then cameras and places adjusted to what lies within; the last round leaves out what is
// far off for good.
std::optional<WandRefusal> go_round(const WandViews& views, const Round& round, bool last, const WandSettings& settings,
                                    const std::function<bool(int)>& steps, Bundle& bundle) {
  place_wand(views, bundle, {.gate_px = round.gate_px, .most_samples = round.most_samples});
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
  if (last) {
    drop_outliers(bundle);
    adjusting.outlier_sigmas = 0.0;
  }
  if (!adjust(bundle, adjusting, steps)) {
    return WandRefusal{WandFault::NoSolution,
                       "the cameras and the wand do not explain each other; see that the wand's "
                       "lengths and the lens files are right"};
  }
  if (last && drop_outliers(bundle) > 0 && !adjust(bundle, adjusting, steps))
    return WandRefusal{WandFault::NoSolution, kEnded};
  return std::nullopt;
}

}  // namespace

Result<WandSolution, WandRefusal> solve_wand(const Take& take, const Rig& start, const Wand& wand,
                                             const WandSettings& settings, const Progress& progress) {
  const auto going_on = [&](const char* doing, double share) { return !progress || progress(doing, share); };
  const WandRefusal ended{WandFault::NoSolution, kEnded};
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
    const bool last = r + 1 == rounds.size();
    const auto steps = [&](int step) {
      return going_on("adjusting", (static_cast<double>(r) + static_cast<double>(step) / round.most_steps) /
                                       static_cast<double>(rounds.size()));
    };
    if (auto refusal = go_round(*views, round, last, settings, steps, bundle)) return *refusal;
    // Before the gates get narrow and leave out what moves fast.
    if (r + 1 == rounds.size() / 2) {
      if (auto refusal = refuse_time(time_offsets(*views, bundle, 2.0 * round.gate_px), bundle.rig)) return *refusal;
      if (auto refusal = refuse_marks(bundle)) return *refusal;
    }
    if (last || (r == 0 && settings.lens_known)) {
      if (auto refusal = refuse_odd(*views, bundle, settings, reach_px)) return *refusal;
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
