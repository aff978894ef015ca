#pragma once

#include <filesystem>

#include "base/result.h"

namespace mocap::corpus {

/// Cuts six images of the particle experiment of the shared data: the middle of each image without its uneven
/// background, as NAME.png, and the spots that another program found there, as NAME.tsv (x, y in px). Fails with
/// NotFound without the shared data, and with Io.
Status cut_images(const std::filesystem::path& folder);

}  // namespace mocap::corpus
