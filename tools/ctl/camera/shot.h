#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/blob.h"
#include "model/frame.h"

namespace mocap::ctl {

/// Writes the image as an 8-bit PNG, with a box around each blob and its index in `blobs`. Fails with Io.
Status save_shot(const std::filesystem::path& path, const Image& image, const Blobs& blobs);

}  // namespace mocap::ctl
