#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"

namespace mocap::cameras {

/// When each recorded image was exposed, by its frame number.
using RecordedTimes = std::map<std::uint64_t, Timestamp>;

/// Reads a timestamps.csv: a header line `frame,time_ns`, then one row a frame, numbers and times growing. Fails with
/// NotFound where there is no such file, and with InvalidArgument naming file and line where a row is wrong.
Result<RecordedTimes> read_recorded_times(const std::filesystem::path& file);

/// One recorded image that can be played.
struct RecordedFrame {
  std::uint64_t number = 0;
  Timestamp exposed_at;
  std::filesystem::path file;  ///< empty in a video
};

/// What one camera recorded: either numbered images, or a video.
struct Recording {
  std::vector<RecordedFrame> frames;  ///< in the order of their numbers
  std::filesystem::path video;        ///< empty: numbered images
};

/// Looks through a camera's folder: `folder` itself, or `folder`/`camera` where that is one. Images are named by their
/// frame number (.pgm, .png); a number that is left out is a lost image. In a video the k-th image (from 0) is the k-th
/// row of timestamps.csv. Without timestamps.csv, number n was exposed n periods of `rate_hz` after time 0.
Result<Recording> find_recording(const std::filesystem::path& folder, const std::string& camera, double rate_hz);

}  // namespace mocap::cameras
