#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/scoring/labels_score.h"
#include "lib/scoring/skeleton_score.h"

namespace mocap::score {

/// Writes an SVG with one line for each marker over time, coloured by the state of its label. `names` by marker; a
/// marker without a name gets its number. Fails with Io.
Status plot_names(const std::filesystem::path& file, const std::string& title, const scoring::Timeline& timeline,
                  const std::vector<std::string>& names);

/// Writes an SVG with the rms and the largest joint error of each set over time, mm on a logarithmic scale. Fails with
/// Io.
Status plot_errors(const std::filesystem::path& file, const std::string& title,
                   const std::vector<scoring::JointErrors>& errors);

}  // namespace mocap::score
