#pragma once

#include <string>
#include <vector>

#include "export/clip/clip.h"

namespace mocap::exports {

/// The prefix of the names of a subject's markers and bones in a file: "NAME:" if the clip has more than one subject,
/// otherwise nothing.
std::string prefix_of(const Clip& clip, const ClipSubject& subject);

/// The label of each marker of the clip, subject after subject, for example "anna:LASI".
std::vector<std::string> marker_labels(const Clip& clip);

/// The marker samples of one frame, in the order of `marker_labels`.
std::vector<MarkerSample> markers_in(const Clip& clip, std::size_t frame);

}  // namespace mocap::exports
