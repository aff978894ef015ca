#include "label/search_reports.h"

namespace mocap::label {
namespace {

// Health is published once a second.
constexpr Duration kReportPeriod = std::chrono::seconds(1);

}  // namespace

bool SearchReports::due(SubjectId subject, Timestamp at) {
  std::optional<Timestamp>& due_at = due_at_[subject.value];
  if (!due_at || at < *due_at - kReportPeriod) due_at = at + kReportPeriod;  // missing since this set, or time ran back
  if (at < *due_at) return false;
  due_at = at + kReportPeriod;
  return true;
}

const SearchReport& SearchReports::make(SubjectId subject, bool is_fitted, const LabelledTracks& tracks,
                                        const StationaryTracks& stationary, Timestamp at) {
  report_.subject = subject;
  report_.is_fitted = is_fitted;
  report_.at = at;
  report_.still = 0;
  report_.points.clear();
  for (const TrackState wanted : {TrackState::Confirmed, TrackState::Candidate}) {
    for (std::size_t i = 0; i < tracks.tracked->size(); ++i) {
      const TrackedMarker& track = (*tracks.tracked)[i];
      const bool is_still = stationary.rest_duration(i) >= still_for_;
      const bool counts = track.state == wanted && !tracks.labelled[i] && track.position.v.allFinite();
      if (!counts || (wanted == TrackState::Candidate && !is_still)) continue;
      if (!report_.points.try_push_back(track.position)) break;
      if (wanted == TrackState::Confirmed && is_still) ++report_.still;
    }
    if (wanted == TrackState::Confirmed) report_.confirmed = static_cast<std::uint32_t>(report_.points.size());
  }
  return report_;
}

}  // namespace mocap::label
