#include "export/labels.h"

namespace mocap::exports {

std::string prefix_of(const Clip& clip, const ClipSubject& subject) {
  return clip.subjects.size() > 1 ? subject.subject.name + ":" : std::string();
}

std::vector<std::string> marker_labels(const Clip& clip) {
  std::vector<std::string> labels;
  for (const ClipSubject& subject : clip.subjects) {
    for (const MarkerOnBone& marker : subject.subject.marker_set.markers) {
      labels.push_back(prefix_of(clip, subject) + marker.name);
    }
  }
  return labels;
}

std::vector<MarkerSample> markers_in(const Clip& clip, std::size_t frame) {
  std::vector<MarkerSample> markers;
  for (const ClipSubject& subject : clip.subjects) {
    const std::size_t count = subject.subject.marker_set.markers.size();
    const auto begin = subject.markers.begin() + static_cast<std::ptrdiff_t>(frame * count);
    markers.insert(markers.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
  }
  return markers;
}

}  // namespace mocap::exports
