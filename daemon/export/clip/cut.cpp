#include "export/clip/edit_clip.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "export/clip/clip_timecode.h"
#include "model/clock/timecode.h"

namespace mocap::exports {
namespace {

// In frames: seconds with six digits mean a frame up to 200 Hz.
constexpr double kSameFrame = 1e-4;

// The time of a range's end after the first frame of the clip, in frames of the clip.
Result<double> frame_at(const Clip& clip, const RangeEnd& end) {
  if (end.kind == RangeEnd::Kind::Frame) return static_cast<double>(end.frame - clip.first_frame);
  if (end.kind == RangeEnd::Kind::Seconds) {
    return end.seconds * clip.rate.hz() - static_cast<double>(clip.first_frame);
  }
  if (!clip.first_timecode) {
    return Error{ErrorCode::InvalidArgument, fmt::format("range {}: the take has no timecode; give seconds (12.5) or "
                                                         "frames (1500f)",
                                                         end.timecode)};
  }
  const Timecode& first = *clip.first_timecode;
  const auto at = parse_timecode(end.timecode, first);
  if (!at) {
    return Error{ErrorCode::InvalidArgument, fmt::format("range {}: not a timecode of {} frames per second, expected "
                                                         "HH:MM:SS:FF",
                                                         end.timecode, first.frames_per_second)};
  }
  std::int64_t frames = frames_of(*at) - frames_of(first);
  const std::int64_t day = frames_of(timecode_of(-1, first)) + 1;
  if (frames < -day / 2) frames += day;  // the take passes midnight
  return static_cast<double>(frames) / rate_hz(first) * clip.rate.hz() - first.subframe;
}

template <class Sample>
void keep(std::vector<Sample>& samples, std::size_t frames, std::size_t first, std::size_t count) {
  const std::size_t width = frames == 0 ? 0 : samples.size() / frames;
  samples.erase(samples.begin() + static_cast<std::ptrdiff_t>((first + count) * width), samples.end());
  samples.erase(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(first * width));
  samples.shrink_to_fit();
}

void keep(Clip& clip, std::size_t first, std::size_t count) {
  const double begin_s = clip.rate.time_s(static_cast<std::int64_t>(first));
  const double length_s = clip.rate.time_s(static_cast<std::int64_t>(count));
  for (ClipSubject& subject : clip.subjects) {
    keep(subject.markers, clip.frames, first, count);
    keep(subject.bones, clip.frames, first, count);
  }
  const double same_s = kSameFrame / clip.rate.hz();  // so that rounding moves no event over an end
  for (ClipEvent& event : clip.events) event.time_s -= begin_s;
  std::erase_if(clip.events,
                [&](const ClipEvent& event) { return event.time_s < -same_s || event.time_s >= length_s - same_s; });
  if (clip.first_utc_ns) *clip.first_utc_ns += std::llround(1e9 * begin_s);
  if (clip.first_timecode) clip.first_timecode = timecode_at(clip, begin_s);
  clip.first_frame += static_cast<std::int64_t>(first);
  clip.frames = count;
}

}  // namespace

std::optional<RangeEnd> parse_range_end(std::string_view text) {
  const std::string copy(text);
  RangeEnd end;
  long long frame = 0;
  char unit = 0, more = 0;
  if (copy.find(':') != std::string::npos) {
    end.kind = RangeEnd::Kind::Timecode;
    end.timecode = copy;
    return end;
  }
  if (std::sscanf(copy.c_str(), "%lld%c%c", &frame, &unit, &more) == 2 && unit == 'f') {
    end.kind = RangeEnd::Kind::Frame;
    end.frame = frame;
    return end;
  }
  const int read = std::sscanf(copy.c_str(), "%lf%c%c", &end.seconds, &unit, &more);
  const bool in_seconds = read == 1 || (read == 2 && unit == 's');
  if (!in_seconds || !std::isfinite(end.seconds)) return std::nullopt;
  return end;
}

Result<Clip> cut(Clip clip, const RangeEnd& from, const RangeEnd& to) {
  const Result<double> begin = frame_at(clip, from), end = frame_at(clip, to);
  if (!begin) return begin.error();
  if (!end) return end.error();
  const double last_frame = static_cast<double>(clip.frames) - 1.0;
  const double first = std::max(0.0, std::ceil(*begin - kSameFrame));
  const double last = std::min(last_frame, std::floor(*end + kSameFrame));
  if (!(first <= last)) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("the range has no frame: the take has frames {} to {}, {:.3f} s at {:.6g} Hz",
                             clip.first_frame, clip.first_frame + static_cast<std::int64_t>(clip.frames) - 1,
                             clip.rate.time_s(static_cast<std::int64_t>(clip.frames) - 1), clip.rate.hz())};
  }
  keep(clip, static_cast<std::size_t>(first), static_cast<std::size_t>(last - first) + 1);
  return clip;
}

}  // namespace mocap::exports
