#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "paper_study/clip.h"
#include "paper_study/follow.h"
#include "paper_study/quality.h"

namespace mocap::paper_study {

/// A clip as a tracker lived through it, as an SVG image: the markers' ways (the labelled one black), barriers, the
/// prediction for each frame (red point; a line to where the marker was), the gate (blue circle, every fifth frame and
/// where it missed), and where the label ended.
std::string plot(const Clip& clip, const Followed& followed, const std::string& title);

/// Writes `<situation>_<clip>_<method>.svg` of the first three clips of each situation, for every method. The folder is
/// made where it is missing. Fails with Io.
Status draw_plots(const QualitySettings& settings, const std::filesystem::path& folder);

}  // namespace mocap::paper_study
