#include "export/clip/edit_clip.h"

#include <cmath>
#include <utility>

#include "export/clip/interpolation.h"

namespace mocap::exports {
namespace {

// A time as a recorded frame and the share of the way to the next one.
struct Place {
  std::size_t frame = 0;
  double share = 0.0;  // 0 exactly at a recorded frame
};

// Integers: 29.97 Hz has no rounding error.
Place place_of(std::size_t frame, const Rate& rate, const Rate& recorded) {
  const std::int64_t scale = rate.numerator * recorded.denominator;
  const std::int64_t at = static_cast<std::int64_t>(frame) * rate.denominator * recorded.numerator;
  return {static_cast<std::size_t>(at / scale), static_cast<double>(at % scale) / static_cast<double>(scale)};
}

template <class Sample>
std::vector<Sample> resampled(const std::vector<Sample>& samples, std::size_t width, const std::vector<Place>& places) {
  std::vector<Sample> all(places.size() * width);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& [frame, share] = places[i];
    for (std::size_t column = 0; column < width; ++column) {
      const Sample* from = &samples[frame * width + column];
      Sample& sample = all[i * width + column];
      if (share == 0.0) {
        sample = *from;
        continue;
      }
      const Sample* to = from + width;
      if (!known(*from) || !known(*to)) continue;
      Neighbours<Sample> near{nullptr, from, to, nullptr, 1.0};
      if (frame > 0 && known(*(from - width))) near.before = from - width;
      if ((frame + 2) * width < samples.size() && known(*(to + width))) near.after = to + width;
      sample = between(near, share);
    }
  }
  return all;
}

}  // namespace

Clip resampled(Clip clip, const Rate& rate) {
  const bool same = rate.numerator * clip.rate.denominator == clip.rate.numerator * rate.denominator;
  if (same || clip.frames == 0) return clip;
  std::vector<Place> places;
  for (Place place; place.frame + 1 < clip.frames || (place.frame + 1 == clip.frames && place.share == 0.0);
       place = place_of(places.size(), rate, clip.rate)) {
    places.push_back(place);
  }
  for (ClipSubject& subject : clip.subjects) {
    subject.markers = resampled(subject.markers, subject.subject.marker_set.markers.size(), places);
    subject.bones = resampled(subject.bones, subject.subject.marker_set.skeleton.bones.size(), places);
  }
  clip.first_frame = std::llround(clip.rate.time_s(clip.first_frame) * rate.hz());
  clip.frames = places.size();
  if (clip.first_timecode) {
    std::uint32_t& subframe = clip.first_timecode->subframe;
    subframe = static_cast<std::uint32_t>(subframe * rate.hz() / clip.rate.hz());
  }
  clip.rate = rate;
  return clip;
}

}  // namespace mocap::exports
