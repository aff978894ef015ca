#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "lib/scoring/clear_mot.h"
#include "lib/scoring/frames.h"

namespace mocap::scoring {

inline constexpr double kRightWithin_m = 0.020;   ///< a label at most this far from its own marker is right
inline constexpr std::uint32_t kVisibleFrom = 2;  ///< number of cameras from which a marker counts as visible
inline constexpr double kGhostFrom_m =
    0.050;  ///< an unlabelled marker farther than this from all true markers is a ghost

/// Counts of one subject's labels over the scored sets. Scoring begins with the subject's first measured label. A
/// subject that is never labelled is scored over all sets. A label with state Measured is
///   right    if it lies within 20 mm of its own marker and does not lie on another marker,
///   wrong    otherwise. It lies on another marker if that marker is within 20 mm and less than half as far as its own,
///   unjudged if the truth lacks its marker in this set (a gap of a recording).
/// A marker is visible if at least two cameras see it or, where the truth has no camera counts, if it is Measured.
/// A wrong-label event is a run of consecutive sets in which one label is wrong.
struct LabelCounts {
  std::uint64_t sets = 0;           ///< scored
  std::uint64_t right = 0;          ///< labels that are Measured and right
  std::uint64_t wrong = 0;          ///< labels that are Measured and wrong
  std::uint64_t exchanged = 0;      ///< wrong labels that lie on a marker of another subject
  std::uint64_t unjudged = 0;       ///< Measured labels whose markers the truth lacks in that set
  std::uint64_t visible = 0;        ///< visible markers, summed over the sets
  std::uint64_t visible_right = 0;  ///< visible markers with the right label
  std::uint64_t filled = 0;         ///< labels that are Filled and whose markers the truth has
  std::uint64_t filled_off = 0;     ///< Filled labels more than 20 mm from their markers
  std::uint64_t wrong_events = 0;
  std::uint64_t longest_wrong_sets = 0;
  std::uint64_t seen_sets = 0;     ///< scored sets in which at least one marker of the subject is visible
  std::uint64_t tracked_sets = 0;  ///< seen sets in which the subject is Tracking with a complete skeleton
  double squares_m2 = 0.0;         ///< sum of the squared distances of right labels
  double filled_squares_m2 = 0.0;
  std::vector<double> first_label_s;  ///< one entry for each labelled subject, since the first set
  /// One entry for each outage (no marker visible for at least 0.1 s): the time from the first set with a visible
  /// marker to the first set in which 90 % of the visible markers have the right label and no label is wrong. Infinite
  /// if there is no such set.
  std::vector<double> reacquire_s;

  std::optional<double> precision() const;  ///< right / (right + wrong); empty without labels
  std::optional<double> recall() const;     ///< visible_right / visible
  std::optional<double> f1() const;         ///< 0 without labels
  std::optional<double> availability() const;
  std::optional<double> marker_rms_mm() const;
  std::optional<double> filled_rms_mm() const;
  /// The 95th percentile of reacquire_s. Empty without outages.
  std::optional<double> reacquire_p95_s() const;
  /// The share of the outages with reacquire_s at most `within_s`. Empty without outages.
  std::optional<double> reacquired_share(double within_s) const;

  /// Adds the counts of another subject or another clip.
  void add(const LabelCounts& other);
};

struct MarkerOf {
  std::uint32_t subject = 0;
  std::uint32_t marker = 0;
};

/// The verdict on one label in one set, for the timeline.
enum class LabelVerdict : std::uint8_t { Unseen, Lost, Right, Wrong, Filled, FilledOff };

/// A run of sets in which one label was wrong.
struct WrongEvent {
  std::uint32_t subject = 0;
  std::uint32_t marker = 0;
  double from_s = 0.0;  ///< since the first set
  std::uint64_t sets = 0;
  double farthest_m = 0.0;     ///< largest distance from the label's own marker
  std::optional<MarkerOf> on;  ///< the other marker on which the label lay in the first set, if any
};

/// The timeline of one subject: for each marker, the verdicts of all sets.
struct Timeline {
  std::vector<double> t_s;
  std::vector<std::vector<LabelVerdict>> markers;
};

/// Scores the labels of a stream, set by set.
class LabelScorer {
 public:
  /// `keeps_timeline`: keep every verdict for plots, one byte for each label and set.
  explicit LabelScorer(bool keeps_timeline = false) : keeps_timeline_(keeps_timeline) {}

  /// Adds one set. Sets must be added in the order of their exposure.
  void add(const EvalFrame& truth, const EvalFrame& reported);

  /// Ends the events that still last and returns the counts by subject. Do not call add() afterwards.
  std::map<std::uint32_t, LabelCounts> finish();

  const ClearMot::Counts& mot() const { return mot_.counts(); }
  std::uint64_t unlabelled() const { return unlabelled_; }
  std::uint64_t ghosts() const { return ghosts_; }
  const std::map<std::uint32_t, Timeline>& timelines() const { return timelines_; }
  /// Sorted by the end of the events. Complete after finish().
  const std::vector<WrongEvent>& wrong_events() const { return wrong_; }

 private:
  struct Subject {
    bool begun = false;  // the subject had a measured label
    std::optional<Timestamp> dark_since, light_since;
    bool reacquiring = false;
    std::vector<WrongEvent> wrong_run;  // by marker: the event that still lasts, or an event of 0 sets
    LabelCounts before, counts;         // until the first label, and since then
  };
  struct Verdicts {
    std::uint64_t visible = 0, right = 0, wrong = 0;
  };

  Verdicts judge(std::uint32_t id, Subject& subject, const EvalFrame& truth, const EvalFrame& reported);
  struct Judged {
    LabelVerdict state = LabelVerdict::Unseen;
    double off_m = 0.0;
    const NamedMarker* on = nullptr;  // the other marker on which the label lies, or null
  };
  Judged judge_name(const NamedMarker& name, const EvalFrame& truth, LabelCounts& counts) const;
  static void note_wrong(const NamedMarker& name, const Judged& judged, WrongEvent& run, double t_s);
  void keep(std::uint32_t id, const std::vector<LabelVerdict>& states, double t_s);
  void end_event(WrongEvent& run, LabelCounts& counts);
  void follow_outage(Subject& subject, const Verdicts& verdicts, Timestamp at) const;
  void count_mot(const EvalFrame& truth, const EvalFrame& reported);
  void count_ghosts(const EvalFrame& truth, const EvalFrame& reported);

  bool keeps_timeline_;
  std::optional<Timestamp> begun_at_;
  std::map<std::uint32_t, Subject> subjects_;
  std::map<std::uint32_t, Timeline> timelines_;
  std::vector<WrongEvent> wrong_;
  ClearMot mot_;
  std::uint64_t unlabelled_ = 0, ghosts_ = 0;
  std::vector<std::uint64_t> objects_, tracks_;
  std::vector<const NamedMarker*> own_;
  std::vector<MotPair> pairs_;
};

/// Whether at least two cameras see the marker or, if the truth has no camera counts, whether the marker is Measured.
bool is_visible(const NamedMarker& true_marker);

}  // namespace mocap::scoring
