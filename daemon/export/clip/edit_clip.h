#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "export/clip/clip.h"

namespace mocap::exports {

/// Which samples other than measured ones a file has.
struct Fill {
  bool recorded = true;    ///< markers that the daemon predicted
  double longest_s = 0.0;  ///< gaps up to this length are interpolated; 0: none
};

/// Leaves out and interpolates samples. Interpolated samples are Filled.
Clip with_fill(Clip clip, const Fill& fill);

/// One end of a range of a take.
struct RangeEnd {
  enum class Kind { Seconds, Frame, Timecode };

  Kind kind = Kind::Seconds;
  double seconds = 0.0;    ///< after the first frame of the take
  std::int64_t frame = 0;  ///< number in the take, from 0, at the recorded rate
  std::string timecode;
};

/// Reads "12.5" or "12.5s", "1500f" and "01:02:03:04"; empty if the text is none of these.
std::optional<RangeEnd> parse_range_end(std::string_view text);

/// The frames from `from` to `to`, both included. Fails with InvalidArgument if there are none, or if the take has no
/// timecode and an end is one.
Result<Clip> cut(Clip clip, const RangeEnd& from, const RangeEnd& to);

/// The clip at another rate. A frame at the time of a recorded frame is that frame; any other is interpolated between
/// two recorded frames (cubic or linear, slerp), and Lost if one of these is.
Clip resampled(Clip clip, const Rate& rate);

}  // namespace mocap::exports
