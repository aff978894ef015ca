#pragma once

#include <array>
#include <optional>

#include "base/archive.h"
#include "label/labelled_tracks.h"
#include "label/stationary_tracks.h"
#include "model/search_report.h"

namespace mocap::label {

/// Collects the evidence for missing subjects, once a second and subject after a first second without it. Changes
/// nothing in the search. Never allocates. One thread.
class SearchReports {
 public:
  /// `still_for`: time after which a track counts as stationary.
  explicit SearchReports(Duration still_for) : still_for_(still_for) {}

  /// The subject is tracked or away in this set.
  void found(SubjectId subject) { due_at_[subject.value].reset(); }
  /// Whether the report of a subject that is missing at `at` is due; the next one is then due a second later.
  bool due(SubjectId subject, Timestamp at);
  /// The report of this set, without views. Borrowed until the next call.
  const SearchReport& make(SubjectId subject, bool is_fitted, const LabelledTracks& tracks,
                           const StationaryTracks& stationary, Timestamp at);

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(due_at_); }

 private:
  Duration still_for_;
  std::array<std::optional<Timestamp>, kMaxSubjects> due_at_;  // by subject; empty: not missing
  SearchReport report_;
};

}  // namespace mocap::label
