#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "paper_study/clip.h"
#include "paper_study/follow.h"
#include "paper_study/quality.h"

namespace mocap::paper_study {

/// Draws the result of a tracker in a clip as an SVG image: the paths of the markers (labelled marker in black),
/// barriers, the prediction for each frame (red point with a line to the true position), the gate (blue circle, every
/// fifth frame and after a miss), and the last position of the label.
std::string plot(const Clip& clip, const Followed& followed, const std::string& title);

/// Writes `<situation>_<clip>_<method>.svg` of the first three clips of each situation, for every method. Creates the
/// folder if needed. Fails with Io.
Status draw_plots(const QualitySettings& settings, const std::filesystem::path& folder);

}  // namespace mocap::paper_study
