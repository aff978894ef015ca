#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/blob.h"
#include "model/frame.h"

namespace mocap::ctl {

/// Writes the image as a PNG of 8 bits, each blob in a box with its number of the list.
Status save_shot(const std::filesystem::path& path, const Image& image, const Blobs& blobs);

}  // namespace mocap::ctl
