#pragma once

#include <filesystem>

#include "base/result.h"
#include "corpus/plans.h"
#include "corpus/recording.h"

namespace mocap::corpus {

/// Simulates an episode and records the inputs of the daemon. Blobs are rounded (1/32 px), so that the file is small.
Result<Recording> simulate(const chaos::Episode& episode);

/// The same with the motion of a file. Fails with NotFound if the shared data are missing.
Result<Recording> simulate(const MotionPlan& plan);

/// Writes the corpus into `folder`: all recordings, the images, and the folder `world` with the rig and the bodies of
/// today. Fails with Busy if the folder has a recording of one of the names, and with NotFound without the shared data.
Status make_corpus(const std::filesystem::path& folder);

}  // namespace mocap::corpus
