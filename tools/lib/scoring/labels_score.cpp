#include "lib/scoring/labels_score.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mocap::scoring {
namespace {

constexpr Duration kOutageFrom = std::chrono::milliseconds(100);  // shortest outage that counts
constexpr double kReacquiredShare = 0.9;  // share of the visible markers with the right label that ends an outage
constexpr double kNearerBy =
    0.5;  // measurement noise alone never makes another marker half as far away as the own marker

std::optional<double> share(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

std::optional<double> rms_mm(double squares_m2, std::uint64_t count) {
  if (count == 0) return std::nullopt;
  return 1000.0 * std::sqrt(squares_m2 / static_cast<double>(count));
}

const NamedMarker* find_own(const std::vector<NamedMarker>& markers, const NamedMarker& name) {
  const auto own = std::ranges::find_if(
      markers, [&](const NamedMarker& m) { return m.subject == name.subject && m.marker == name.marker; });
  return own == markers.end() ? nullptr : &*own;
}

std::uint64_t name_of(const NamedMarker& m) { return (std::uint64_t{m.subject} << 32) | m.marker; }

}  // namespace

bool is_visible(const NamedMarker& true_marker) {
  if (true_marker.cameras == 0) return true_marker.state == LabelState::Measured;
  return true_marker.cameras >= kVisibleFrom;
}

std::optional<double> LabelCounts::precision() const { return share(right, right + wrong); }
std::optional<double> LabelCounts::recall() const { return share(visible_right, visible); }
std::optional<double> LabelCounts::f1() const {
  const auto p = precision(), r = recall();
  if (!r) return std::nullopt;
  if (!p || *p + *r == 0.0) return 0.0;
  return 2.0 * *p * *r / (*p + *r);
}
std::optional<double> LabelCounts::availability() const { return share(tracked_sets, seen_sets); }
std::optional<double> LabelCounts::marker_rms_mm() const { return rms_mm(squares_m2, right); }
std::optional<double> LabelCounts::filled_rms_mm() const { return rms_mm(filled_squares_m2, filled); }

std::optional<double> LabelCounts::reacquire_p95_s() const {
  if (reacquire_s.empty()) return std::nullopt;
  std::vector<double> sorted = reacquire_s;
  std::ranges::sort(sorted);
  const auto rank = static_cast<std::size_t>(std::ceil(0.95 * static_cast<double>(sorted.size()))) - 1;
  return sorted[rank];
}

std::optional<double> LabelCounts::reacquired_share(double within_s) const {
  const auto soon = std::ranges::count_if(reacquire_s, [&](double s) { return s <= within_s + 1e-9; });
  return share(static_cast<std::uint64_t>(soon), reacquire_s.size());
}

void LabelCounts::add(const LabelCounts& other) {
  sets += other.sets;
  right += other.right;
  wrong += other.wrong;
  exchanged += other.exchanged;
  unjudged += other.unjudged;
  visible += other.visible;
  visible_right += other.visible_right;
  filled += other.filled;
  filled_off += other.filled_off;
  wrong_events += other.wrong_events;
  longest_wrong_sets = std::max(longest_wrong_sets, other.longest_wrong_sets);
  seen_sets += other.seen_sets;
  tracked_sets += other.tracked_sets;
  squares_m2 += other.squares_m2;
  filled_squares_m2 += other.filled_squares_m2;
  first_label_s.insert(first_label_s.end(), other.first_label_s.begin(), other.first_label_s.end());
  reacquire_s.insert(reacquire_s.end(), other.reacquire_s.begin(), other.reacquire_s.end());
}

void LabelScorer::add(const EvalFrame& truth, const EvalFrame& reported) {
  if (!begun_at_) begun_at_ = reported.exposed_at;
  for (const NamedMarker& marker : truth.markers) subjects_.try_emplace(marker.subject);
  for (auto& [id, subject] : subjects_) {
    const auto measured = [&, id = id](const NamedMarker& name) {
      return name.subject == id && name.state == LabelState::Measured;
    };
    if (!subject.begun && std::ranges::any_of(reported.markers, measured)) {
      subject.begun = true;
      subject.counts.first_label_s.push_back(to_s(reported.exposed_at - *begun_at_));
    }
    const Verdicts verdicts = judge(id, subject, truth, reported);
    follow_outage(subject, verdicts, reported.exposed_at);
  }
  count_mot(truth, reported);
  count_ghosts(truth, reported);
}

void LabelScorer::end_event(WrongEvent& run, LabelCounts& counts) {
  if (run.sets == 0) return;
  ++counts.wrong_events;
  counts.longest_wrong_sets = std::max(counts.longest_wrong_sets, run.sets);
  wrong_.push_back(run);
  run = {};
}

void LabelScorer::note_wrong(const NamedMarker& name, const Judged& judged, WrongEvent& run, double t_s) {
  if (run.sets == 0) {
    run = {name.subject, name.marker, t_s, 0, 0.0, std::nullopt};
    if (judged.on != nullptr) run.on = MarkerOf{judged.on->subject, judged.on->marker};
  }
  ++run.sets;
  run.farthest_m = std::max(run.farthest_m, judged.off_m);
}

LabelScorer::Judged LabelScorer::judge_name(const NamedMarker& name, const EvalFrame& truth,
                                            LabelCounts& counts) const {
  const bool measured = name.state == LabelState::Measured;
  const NamedMarker* own = find_own(truth.markers, name);
  if (own == nullptr) {
    counts.unjudged += measured ? 1U : 0U;
    return {LabelVerdict::Unseen, 0.0, nullptr};
  }
  const double off_m = (name.position_m - own->position_m).norm();
  if (!measured) {
    ++counts.filled;
    counts.filled_squares_m2 += off_m * off_m;
    if (off_m <= kRightWithin_m) return {LabelVerdict::Filled, off_m, nullptr};
    ++counts.filled_off;
    return {LabelVerdict::FilledOff, off_m, nullptr};
  }
  double other_m = std::numeric_limits<double>::max();
  const NamedMarker* other = nullptr;
  for (const NamedMarker& m : truth.markers) {
    const double away_m = (name.position_m - m.position_m).norm();
    if (&m == own || away_m >= other_m) continue;
    other_m = away_m;
    other = &m;
  }
  const bool on_another = other_m <= kRightWithin_m && other_m < kNearerBy * off_m;
  if (off_m <= kRightWithin_m && !on_another) {
    ++counts.right;
    counts.squares_m2 += off_m * off_m;
    return {LabelVerdict::Right, off_m, nullptr};
  }
  ++counts.wrong;
  counts.exchanged += on_another && other->subject != name.subject ? 1U : 0U;
  return {LabelVerdict::Wrong, off_m, on_another ? other : nullptr};
}

LabelScorer::Verdicts LabelScorer::judge(std::uint32_t id, Subject& subject, const EvalFrame& truth,
                                         const EvalFrame& reported) {
  LabelCounts& counts = subject.begun ? subject.counts : subject.before;
  Verdicts verdicts;
  ++counts.sets;
  std::uint32_t markers = 0;
  for (const NamedMarker& m : truth.markers) markers = m.subject == id ? std::max(markers, m.marker + 1) : markers;
  for (const NamedMarker& m : reported.markers) markers = m.subject == id ? std::max(markers, m.marker + 1) : markers;
  if (subject.wrong_run.size() < markers) subject.wrong_run.resize(markers);
  std::vector<LabelVerdict> states(subject.wrong_run.size(), LabelVerdict::Unseen);
  for (const NamedMarker& m : truth.markers) {
    if (m.subject != id || !is_visible(m)) continue;
    ++verdicts.visible;
    states[m.marker] = LabelVerdict::Lost;
  }
  for (const NamedMarker& name : reported.markers) {
    if (name.subject != id) continue;
    const bool visible = states[name.marker] == LabelVerdict::Lost;
    const Judged judged = judge_name(name, truth, counts);
    const LabelVerdict state = judged.state;
    if (state != LabelVerdict::Unseen) states[name.marker] = state;
    if (state == LabelVerdict::Wrong)
      note_wrong(name, judged, subject.wrong_run[name.marker], to_s(reported.exposed_at - *begun_at_));
    verdicts.right += visible && state == LabelVerdict::Right ? 1U : 0U;
    verdicts.wrong += state == LabelVerdict::Wrong ? 1U : 0U;
  }
  for (std::size_t m = 0; m < states.size(); ++m) {
    if (states[m] != LabelVerdict::Wrong) end_event(subject.wrong_run[m], counts);
  }
  counts.visible += verdicts.visible;
  counts.visible_right += verdicts.right;
  if (verdicts.visible > 0) {
    ++counts.seen_sets;
    const auto whole = [&](const SubjectSaid& s) {
      return s.subject == id && s.phase == SubjectPhase::Tracking && s.whole;
    };
    counts.tracked_sets += std::ranges::any_of(reported.subjects, whole) ? 1U : 0U;
  }
  if (keeps_timeline_) keep(id, states, to_s(reported.exposed_at - *begun_at_));
  return verdicts;
}

void LabelScorer::keep(std::uint32_t id, const std::vector<LabelVerdict>& states, double t_s) {
  Timeline& line = timelines_[id];
  line.t_s.push_back(t_s);
  if (line.markers.size() < states.size()) {
    line.markers.resize(states.size(), std::vector<LabelVerdict>(line.t_s.size() - 1, LabelVerdict::Unseen));
  }
  for (std::size_t m = 0; m < states.size(); ++m) line.markers[m].push_back(states[m]);
}

void LabelScorer::follow_outage(Subject& subject, const Verdicts& verdicts, Timestamp at) const {
  if (!subject.begun) return;
  if (verdicts.visible == 0) {
    if (!subject.dark_since) subject.dark_since = at;
    return;
  }
  if (subject.dark_since && at - *subject.dark_since >= kOutageFrom) {
    if (subject.reacquiring) subject.counts.reacquire_s.push_back(std::numeric_limits<double>::infinity());
    subject.reacquiring = true;
    subject.light_since = at;
  }
  subject.dark_since.reset();
  const bool named = verdicts.wrong == 0 &&
                     static_cast<double>(verdicts.right) >= kReacquiredShare * static_cast<double>(verdicts.visible);
  if (!subject.reacquiring || !named) return;
  subject.counts.reacquire_s.push_back(to_s(at - *subject.light_since));
  subject.reacquiring = false;
}

// The objects of CLEAR-MOT are the visible markers. A label of an invisible marker is not counted, unless it lies
// within 20 mm of a visible marker.
void LabelScorer::count_mot(const EvalFrame& truth, const EvalFrame& reported) {
  objects_.clear();
  tracks_.clear();
  pairs_.clear();
  own_.clear();
  for (const NamedMarker& m : truth.markers) {
    if (!is_visible(m)) continue;
    objects_.push_back(name_of(m));
    own_.push_back(&m);
  }
  for (const NamedMarker& name : reported.markers) {
    if (name.state != LabelState::Measured) continue;
    const std::size_t before = pairs_.size();
    const auto track = static_cast<std::uint32_t>(tracks_.size());
    for (std::uint32_t i = 0; i < own_.size(); ++i) {
      const double off_m = (own_[i]->position_m - name.position_m).norm();
      if (off_m <= kRightWithin_m) pairs_.push_back({i, track, off_m});
    }
    const NamedMarker* own = find_own(truth.markers, name);
    const bool no_matter = pairs_.size() == before && (own == nullptr || !is_visible(*own));
    if (!no_matter) tracks_.push_back(name_of(name));
  }
  mot_.add(objects_, tracks_, pairs_);
}

void LabelScorer::count_ghosts(const EvalFrame& truth, const EvalFrame& reported) {
  unlabelled_ += reported.unlabelled_m.size();
  for (const Eigen::Vector3d& found : reported.unlabelled_m) {
    const auto near = [&](const NamedMarker& m) { return (found - m.position_m).norm() <= kGhostFrom_m; };
    const auto near_unlabelled = [&](const Eigen::Vector3d& at) { return (found - at).norm() <= kGhostFrom_m; };
    if (std::ranges::none_of(truth.markers, near) && std::ranges::none_of(truth.unlabelled_m, near_unlabelled))
      ++ghosts_;
  }
}

std::map<std::uint32_t, LabelCounts> LabelScorer::finish() {
  std::map<std::uint32_t, LabelCounts> all;
  for (auto& [id, subject] : subjects_) {
    for (WrongEvent& run : subject.wrong_run) end_event(run, subject.counts);
    if (subject.reacquiring) subject.counts.reacquire_s.push_back(std::numeric_limits<double>::infinity());
    all[id] = subject.begun ? subject.counts : subject.before;
  }
  return all;
}

}  // namespace mocap::scoring
