#include "export/clip/edit_clip.h"

#include <algorithm>
#include <cmath>

#include "export/clip/interpolation.h"

namespace mocap::exports {
namespace {

// Interpolates the gaps of up to `longest` frames of one marker or bone, whose samples are `width` apart.
template <class Sample>
void fill_gaps(std::vector<Sample>& samples, std::size_t column, std::size_t width, std::size_t longest) {
  const std::size_t frames = samples.size() / width;
  const auto at = [&](std::size_t frame) -> Sample& { return samples[frame * width + column]; };
  std::size_t end = 0;
  for (std::size_t frame = 1; frame < frames; ++frame) {
    const std::size_t last = frame - 1;
    if (known(at(frame)) || !known(at(last))) continue;
    for (end = frame; end < frames && !known(at(end));) ++end;
    if (end == frames) return;
    if (end - frame <= longest) {
      const Sample from = at(last);
      Neighbours<Sample> near{nullptr, &from, &at(end), nullptr, static_cast<double>(end - last)};
      if (last > 0 && known(at(last - 1))) near.before = &at(last - 1);
      if (end + 1 < frames && known(at(end + 1))) near.after = &at(end + 1);
      for (std::size_t f = frame; f < end; ++f) at(f) = between(near, static_cast<double>(f - last) / near.frames);
    }
    frame = end;
  }
}

}  // namespace

Clip with_fill(Clip clip, const Fill& fill) {
  // A gap of n frames is n periods long. 1e-6: for limits that are whole frames.
  const auto longest = static_cast<std::size_t>(std::max(0.0, fill.longest_s * clip.rate.hz() + 1e-6));
  for (ClipSubject& subject : clip.subjects) {
    for (MarkerSample& marker : subject.markers) {
      if (!fill.recorded && marker.state == LabelState::Filled) marker = {};
    }
    if (longest == 0) continue;
    const std::size_t markers = subject.subject.marker_set.markers.size();
    const std::size_t bones = subject.subject.marker_set.skeleton.bones.size();
    for (std::size_t m = 0; m < markers; ++m) fill_gaps(subject.markers, m, markers, longest);
    for (std::size_t b = 0; b < bones; ++b) fill_gaps(subject.bones, b, bones, longest);
  }
  return clip;
}

}  // namespace mocap::exports
