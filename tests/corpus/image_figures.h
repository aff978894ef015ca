#pragma once

#include <filesystem>

#include "base/result.h"
#include "corpus/figures.h"

namespace mocap::corpus {

/// The results of the detector on an image: `labels` blobs; `judged` spots that another program found (the file of the
/// same name with .tsv), `wrong` of them without a blob within 1 px, and `rms` of the others, px. Fails if a file
/// cannot be read.
Result<Figures> image_figures_of(const std::filesystem::path& image);

}  // namespace mocap::corpus
