#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/scoring/labels_score.h"
#include "lib/scoring/skeleton_score.h"

namespace mocap::eval {

/// Draws a row a marker over time, coloured by what became of its name, as SVG. `names` by marker; what is missing is
/// called by its number. Fails with Io.
Status plot_names(const std::filesystem::path& file, const std::string& title, const scoring::Timeline& timeline,
                  const std::vector<std::string>& names);

/// Draws the joints' rms and largest error of each set over time, mm on a logarithmic scale, as SVG. Fails with Io.
Status plot_errors(const std::filesystem::path& file, const std::string& title,
                   const std::vector<scoring::JointErrors>& errors);

}  // namespace mocap::eval
