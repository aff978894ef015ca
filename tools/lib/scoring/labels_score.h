#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "lib/scoring/clear_mot.h"
#include "lib/scoring/frames.h"

namespace mocap::scoring {

inline constexpr double kRightWithin_m = 0.020;   ///< a name this near to its marker is right
inline constexpr std::uint32_t kVisibleFrom = 2;  ///< cameras that make a marker visible
inline constexpr double kGhostFrom_m = 0.050;     ///< what is nameless and this far from all lights is none

/// What is counted of a subject's names. Judged are the sets from the subject's first measured name on (all, where
/// there never is one). A name that is shown Measured is
///   right    within 20 mm of its own marker, which is no farther than another (see below),
///   wrong    otherwise: over 20 mm off, or another marker lies within 20 mm and less than half as far as its own,
///   unjudged where the truth does not know its marker then (a gap of a recording).
/// A visible marker is one that two cameras or more see; a truth without numbers of cameras: one that is Measured.
/// A wrong-name event is a run of consecutive sets in which one name is wrong.
struct LabelCounts {
  std::uint64_t sets = 0;           ///< judged
  std::uint64_t right = 0;          ///< names Measured and right
  std::uint64_t wrong = 0;          ///< names Measured and wrong
  std::uint64_t exchanged = 0;      ///< of these, those on a marker of another subject
  std::uint64_t unjudged = 0;       ///< names Measured whose markers the truth does not know then
  std::uint64_t visible = 0;        ///< markers to be named
  std::uint64_t visible_right = 0;  ///< of these, those named rightly
  std::uint64_t filled = 0;         ///< names Filled whose markers the truth knows
  std::uint64_t filled_off = 0;     ///< of these, those over 20 mm off
  std::uint64_t wrong_events = 0;
  std::uint64_t longest_wrong_sets = 0;
  std::uint64_t seen_sets = 0;     ///< judged sets in which some of its markers are visible
  std::uint64_t tracked_sets = 0;  ///< of these, those in which it is Tracking with a whole skeleton
  double squares_m2 = 0.0;         ///< sum over right names of the squared distance
  double filled_squares_m2 = 0.0;
  std::vector<double> first_label_s;  ///< a subject each, from the first set; of those that never had one: none
  /// An outage each: from the first set after at least 0.1 s in which none of its markers was visible, to the set in
  /// which 90 % of those visible bear their names again and none a wrong one; infinite where that never came.
  std::vector<double> reacquire_s;

  std::optional<double> precision() const;  ///< right of those judged; nothing without any
  std::optional<double> recall() const;     ///< of the visible markers, those named rightly
  std::optional<double> f1() const;         ///< 0 where nothing is named
  std::optional<double> availability() const;
  std::optional<double> marker_rms_mm() const;
  std::optional<double> filled_rms_mm() const;
  /// The outage that 95 % do not exceed; nothing without outages, infinite where it never ended.
  std::optional<double> reacquire_p95_s() const;
  std::optional<double> reacquired_share(double within_s) const;

  /// Adds another subject's, or another clip's.
  void add(const LabelCounts& other);
};

struct MarkerOf {
  std::uint32_t subject = 0;
  std::uint32_t marker = 0;
};

/// What one name was in one set, for the timeline.
enum class NameState : std::uint8_t { Unseen, Lost, Right, Wrong, Filled, FilledOff };

/// One name that was wrong for a run of sets.
struct WrongEvent {
  std::uint32_t subject = 0;
  std::uint32_t marker = 0;
  double from_s = 0.0;  ///< since the first set
  std::uint64_t sets = 0;
  double farthest_m = 0.0;     ///< from its own marker
  std::optional<MarkerOf> on;  ///< whose marker it was on in the first set, if any
};

/// One subject's timeline: by marker, the states of all sets.
struct Timeline {
  std::vector<double> t_s;
  std::vector<std::vector<NameState>> markers;
};

/// Judges the names of a stream, set by set.
class LabelScorer {
 public:
  /// `keeps_timeline`: for plots; some bytes for each name and set.
  explicit LabelScorer(bool keeps_timeline = false) : keeps_timeline_(keeps_timeline) {}

  /// Sets come in the order of their instants.
  void add(const EvalFrame& truth, const EvalFrame& said);

  /// By subject; ends the events that still go on. Nothing is added afterwards.
  std::map<std::uint32_t, LabelCounts> finish();

  const ClearMot::Counts& mot() const { return mot_.counts(); }
  std::uint64_t unlabelled() const { return unlabelled_; }
  std::uint64_t ghosts() const { return ghosts_; }
  const std::map<std::uint32_t, Timeline>& timelines() const { return timelines_; }
  /// In the order of their ends; whole after `finish`.
  const std::vector<WrongEvent>& wrong_events() const { return wrong_; }

 private:
  struct Subject {
    bool begun = false;  // a name was shown
    std::optional<Timestamp> dark_since, light_since;
    bool reacquiring = false;
    std::vector<WrongEvent> wrong_run;  // by marker, the one that goes on; without any: no sets
    LabelCounts before, counts;         // until the first name, and from then on
  };
  struct Verdicts {
    std::uint64_t visible = 0, right = 0, wrong = 0;
  };

  Verdicts judge(std::uint32_t id, Subject& subject, const EvalFrame& truth, const EvalFrame& said);
  struct Judged {
    NameState state = NameState::Unseen;
    double off_m = 0.0;
    const NamedMarker* on = nullptr;  // another's marker
  };
  Judged judge_name(const NamedMarker& name, const EvalFrame& truth, LabelCounts& counts) const;
  static void note_wrong(const NamedMarker& name, const Judged& judged, WrongEvent& run, double t_s);
  void keep(std::uint32_t id, const std::vector<NameState>& states, double t_s);
  void end_event(WrongEvent& run, LabelCounts& counts);
  void follow_outage(Subject& subject, const Verdicts& verdicts, Timestamp at) const;
  void count_mot(const EvalFrame& truth, const EvalFrame& said);
  void count_ghosts(const EvalFrame& truth, const EvalFrame& said);

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

/// Whether two cameras see it; where the truth has no numbers of cameras, whether it is Measured.
bool is_visible(const NamedMarker& true_marker);

}  // namespace mocap::scoring
