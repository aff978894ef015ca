#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lib/benchmark/label_tally.h"
#include "lib/benchmark/labelled_clip.h"
#include "lib/benchmark/point_noise.h"
#include "lib/benchmark/withheld.h"

namespace mocap::benchmark {

/// The daemon's knowledge of the person when the clip begins.
enum class BodyKnown {
  Given,       ///< bone lengths and marker offsets, fitted to the clip itself
  Static,      ///< the same, fitted to a static trial of the person
  Calibrated,  ///< what it learns from 1 s of T-pose, with a marker set of another size and with other offsets than the
               ///< body that was fitted to the clip; then nobody is visible for 0.5 s
  Cold,        ///< that marker set only; it is searched for in any pose
};

/// In the order of BodyKnown.
inline constexpr std::string_view kModeNames[] = {"given", "static", "calibrated", "cold"};
/// The mode by name.
std::optional<BodyKnown> mode_named(std::string_view name);
std::string_view text_of(BodyKnown mode);

struct LabelCase {
  BodyKnown mode = BodyKnown::Given;
  PointNoise noise;
  std::uint64_t seed = 1;
  const bodyfit::LabelledTake* static_trial = nullptr;  ///< required by Static; markers of the clip
};

struct LabelRun {
  LabelFigures figures;                                    ///< of all frames, live
  LabelFigures since_first;                                ///< from the first frame with a label on
  double ms_per_frame = 0.0;                               ///< CPU time of the daemon's steps in this thread, mean
  std::vector<Confusion> confusions;                       ///< wrong labels, most frequent first
  std::array<std::uint64_t, kWithheldReasons> withheld{};  ///< points of markers without a label, by reason
  std::vector<std::array<std::uint64_t, kWithheldReasons>> withheld_of;  ///< the same, by marker
  LabelFigures offline;  ///< of all frames, labelled forwards and then backwards (lib/offline)
};

/// Tracks and labels a clip with noise, live, and then backwards with the body that the live pass fitted. All figures
/// but `offline` are of the live pass. The same arguments give the same result, except the time. Fails with
/// InvalidArgument if the body cannot be fitted, and with Io if there is no space for temporary files.
Result<LabelRun> run_labels(const LabelledClip& clip, const LabelCase& wanted);

}  // namespace mocap::benchmark
