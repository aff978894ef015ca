#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"

namespace mocap::cameras {

/// Time of exposure of each recorded image, by its frame number.
using RecordedTimes = std::map<std::uint64_t, Timestamp>;

/// Reads a timestamps.csv: a header line `frame,time_ns`, then one line per frame; numbers and times increase. Fails
/// with NotFound if there is no such file, with InvalidArgument, naming file and line, if a line is invalid or there is
/// no row, and with Io if the file cannot be read to its end.
Result<RecordedTimes> read_recorded_times(const std::filesystem::path& file);

/// A recorded image.
struct RecordedFrame {
  std::uint64_t number = 0;
  Timestamp exposed_at;
  std::filesystem::path file;  ///< empty in a video
};

/// The recording of one camera: numbered images, or a video.
struct Recording {
  std::vector<RecordedFrame> frames;  ///< in order of their numbers
  std::filesystem::path video;        ///< empty: numbered images
};

/// Finds a camera's recording in `folder`/`camera` if that is a folder, otherwise in `folder`. The name of an image
/// file is its frame number (.pgm, .png); a missing number is a lost image. Image k of a video (from 0) belongs to data
/// line k of timestamps.csv. Without timestamps.csv, number n was exposed n periods of `rate_hz` after time 0.
/// Fails with InvalidArgument if that is more than 35 years: the names are times then.
Result<Recording> find_recording(const std::filesystem::path& folder, const std::string& camera, double rate_hz);

}  // namespace mocap::cameras
