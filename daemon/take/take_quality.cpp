#include "take/take_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "model/search_health.h"

namespace mocap::take {
namespace {

// Keys of the metadata of a take.
constexpr const char *kQuality = "quality", *kEndedEarly = "ended_early", *kReasons = "quality_reasons",
                     *kFigures = "quality_figures";

// Judged, not measured: the limits of "look" are what an operator can repair by tracking again or filling gaps, those
// of "bad" are a reason to record once more.
constexpr double kBadLostShare = 0.01, kBadTrackedShare = 0.5, kLookTrackedShare = 0.98;
constexpr double kBadSeenShare = 0.2, kLookSeenShare = 0.8;
constexpr double kLookGap_s = 0.5;
constexpr double kBadCameraShare = 0.5, kLookCameraShare = 0.98;
constexpr double kBadResidual_px = 3.0, kLookResidual_px = 1.0;
constexpr std::size_t kMostNames = 5;  // in a reason

double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

double percent(std::uint64_t part, std::uint64_t whole) { return 100.0 * share(part, whole); }

std::string list_of(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size() && i < kMostNames; ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > kMostNames) text += fmt::format(" and {} more", names.size() - kMostNames);
  return text;
}

// Gathers the reasons: those of "bad" first.
class Reasons {
 public:
  // A value that should be at least `look`.
  void least(double value, double look, double bad, const std::string& reason) {
    if (value < bad) {
      bad_.push_back(reason);
    } else if (value < look) {
      look_.push_back(reason);
    }
  }
  void most(double value, double look, double bad, const std::string& reason) { least(-value, -look, -bad, reason); }

  void apply(QualityReport& report) {
    report.quality = !bad_.empty() ? TakeQuality::Bad : !look_.empty() ? TakeQuality::Look : TakeQuality::Good;
    report.reasons = std::move(bad_);
    report.reasons.insert(report.reasons.end(), look_.begin(), look_.end());
  }

 private:
  std::vector<std::string> bad_, look_;
};

void judge_markers(const QualityReport& report, const SubjectFigures& subject, Reasons& reasons) {
  std::vector<std::string> hardly, seldom, gaps;
  for (const MarkerFigures& marker : subject.markers) {
    const double seen = share(marker.seen, report.sets);
    if (seen < kBadSeenShare) {
      hardly.push_back(fmt::format("{} {:.0f} %", marker.name, 100.0 * seen));
    } else if (seen < kLookSeenShare) {
      seldom.push_back(fmt::format("{} {:.0f} %", marker.name, 100.0 * seen));
    }
    if (marker.longest_gap_s > kLookGap_s)
      gaps.push_back(fmt::format("{} {:.2f} s", marker.name, marker.longest_gap_s));
  }
  if (!hardly.empty()) reasons.least(0.0, 1.0, 0.5, fmt::format("{}: hardly seen: {}", subject.name, list_of(hardly)));
  if (!seldom.empty()) reasons.least(0.5, 1.0, 0.0, fmt::format("{}: seen seldom: {}", subject.name, list_of(seldom)));
  if (!gaps.empty()) reasons.least(0.5, 1.0, 0.0, fmt::format("{}: long gaps: {}", subject.name, list_of(gaps)));
}

void judge_subject(const QualityReport& report, const SubjectFigures& subject, Reasons& reasons) {
  const double tracked = share(subject.tracked_sets, report.sets);
  reasons.least(tracked, kLookTrackedShare, kBadTrackedShare,
                fmt::format("{}: tracked in {:.1f} % of the sets", subject.name, 100.0 * tracked));
  if (tracked < kBadTrackedShare) return;  // its markers follow from that
  judge_markers(report, subject, reasons);
  if (subject.label_changes > 0) {
    reasons.least(0.5, 1.0, 0.0, fmt::format("{}: {} label changes", subject.name, subject.label_changes));
  }
}

// Why sets were lost, as far as it is known.
std::string cause_of(const QualityReport& report) {
  if (report.dropped_sets == 0) return {};
  // Sets that were dropped after the last one of the take are counted, but not lost.
  return fmt::format(", {} because the recorder was late ([queues] side_snapshots)",
                     std::min(report.dropped_sets, report.lost_sets));
}

void judge(QualityReport& report) {
  Reasons reasons;
  if (report.sets == 0) {
    report.quality = TakeQuality::Bad;
    report.reasons = {"no sets"};
    return;
  }
  const std::uint64_t all = report.sets + report.lost_sets;
  reasons.most(share(report.lost_sets, all), 0.0, kBadLostShare,
               fmt::format("{} of {} sets lost{}", report.lost_sets, all, cause_of(report)));
  if (report.lost_images > 0) {
    reasons.least(0.5, 1.0, 0.0,
                  fmt::format("the processor or the disk was too slow for {} images", report.lost_images));
  }
  for (const SubjectFigures& subject : report.subjects) judge_subject(report, subject, reasons);
  for (const CameraFigures& camera : report.cameras) {
    reasons.least(share(camera.sets, report.sets), kLookCameraShare, kBadCameraShare,
                  fmt::format("camera {}: in {:.1f} % of the sets", camera.name, percent(camera.sets, report.sets)));
  }
  reasons.most(report.residual_px, kLookResidual_px, kBadResidual_px,
               fmt::format("residual {:.2f} px", report.residual_px));
  reasons.apply(report);
}

}  // namespace

const char* name_of(TakeQuality quality) {
  switch (quality) {
    case TakeQuality::Good: return "good";
    case TakeQuality::Look: return "look";
    case TakeQuality::Bad: return "bad";
    default: return "unknown";
  }
}

void TakeMeter::describe(const Description& description) {
  by_index_.clear();
  for (const mocap::Subject& subject : description.subjects) {
    auto same = std::ranges::find(subjects_, subject.name, &Subject::name);
    if (same == subjects_.end()) {
      same = subjects_.emplace(subjects_.end());
      same->name = subject.name;
      for (const auto& marker : subject.marker_set.markers) same->markers.push_back(Marker{.name = marker.name});
    }
    by_index_.push_back(static_cast<std::size_t>(same - subjects_.begin()));
  }
  if (cameras_.empty()) {
    for (const CameraModel& camera : description.cameras) cameras_.push_back({camera.name});
  }
}

void TakeMeter::add(const v1::Snapshot& snapshot) {
  const std::int64_t at_ns = snapshot.instants().exposed_at_ns();
  if (sets_ == 0) first_at_ns_ = at_ns;
  if (sets_ > 0 && snapshot.number() > last_number_ + 1) lost_sets_ += snapshot.number() - last_number_ - 1;
  last_number_ = snapshot.number();
  last_at_ns_ = at_ns;
  ++sets_;
  for (const std::uint32_t camera : snapshot.views().cameras()) {
    if (camera < cameras_.size()) ++cameras_[camera].sets;
  }
  for (const v1::SubjectState& subject : snapshot.subjects()) add(subject, at_ns);
}

void TakeMeter::add(const v1::SubjectState& from, std::int64_t at_ns) {
  if (from.subject() >= by_index_.size() || from.phase() != v1::SUBJECT_PHASE_TRACKING) return;
  Subject& subject = subjects_[by_index_[from.subject()]];
  ++subject.tracked_sets;
  if (from.has_residual_m()) {
    subject.residual_sum_m += static_cast<double>(from.residual_m());
    ++subject.residuals;
  }
  const v1::LabelledMarkers& markers = from.markers();
  const int count = std::min(markers.states_size(), static_cast<int>(subject.markers.size()));
  for (int i = 0; i < count; ++i) {
    Marker& marker = subject.markers[static_cast<std::size_t>(i)];
    if (markers.states(i) == v1::MARKER_STATE_FILLED) ++marker.filled;
    if (markers.states(i) != v1::MARKER_STATE_MEASURED) continue;
    ++marker.seen;
    const std::int64_t since = marker.seen_at_ns < 0 ? first_at_ns_ : marker.seen_at_ns;
    marker.longest_gap_ns = std::max(marker.longest_gap_ns, at_ns - since);
    marker.seen_at_ns = at_ns;
    if (i < markers.residuals_millipx_size()) {
      residual_sum_px_ += 1e-3 * markers.residuals_millipx(i);
      ++residuals_;
    }
  }
  count_label_changes(subject, markers);
}

void TakeMeter::count_label_changes(Subject& subject, const v1::LabelledMarkers& markers) {
  tracks_.clear();
  for (std::size_t i = 0; i < subject.markers.size(); ++i) {
    if (subject.markers[i].track != 0) tracks_.emplace(subject.markers[i].track, i);
  }
  for (std::size_t i = 0; i < subject.markers.size(); ++i) {
    const auto column = static_cast<int>(i);
    const std::uint32_t track = column < markers.track_ids_plus_one_size() ? markers.track_ids_plus_one(column) : 0;
    const auto before = tracks_.find(track);
    if (track != 0 && before != tracks_.end() && before->second != i) ++subject.label_changes;
    subject.markers[i].track = track;
  }
}

QualityReport TakeMeter::figures() const {
  QualityReport report;
  report.seconds = 1e-9 * static_cast<double>(last_at_ns_ - first_at_ns_);
  report.sets = sets_;
  report.lost_sets = lost_sets_;
  report.dropped_sets = dropped_sets_;
  report.lost_images = lost_images_;
  report.residual_px = residuals_ == 0 ? 0.0 : residual_sum_px_ / static_cast<double>(residuals_);
  report.cameras = cameras_;
  for (const Subject& subject : subjects_) {
    SubjectFigures& figures = report.subjects.emplace_back();
    figures.name = subject.name;
    figures.tracked_sets = subject.tracked_sets;
    figures.label_changes = subject.label_changes;
    figures.residual_m = subject.residuals == 0 ? 0.0 : subject.residual_sum_m / static_cast<double>(subject.residuals);
    for (const Marker& marker : subject.markers) {
      const std::int64_t since = marker.seen_at_ns < 0 ? first_at_ns_ : marker.seen_at_ns;
      const double gap_s = 1e-9 * static_cast<double>(std::max(marker.longest_gap_ns, last_at_ns_ - since));
      figures.markers.push_back({marker.name, marker.seen, marker.filled, gap_s});
      report.longest_gap_s = std::max(report.longest_gap_s, gap_s);
    }
  }
  return report;
}

QualityReport TakeMeter::report() const {
  QualityReport report = figures();
  judge(report);
  return report;
}

std::string to_json(const QualityReport& report) {
  using nlohmann::ordered_json;
  const auto round = [](double value) { return std::round(value * 1000.0) / 1000.0; };
  ordered_json json{{"quality", name_of(report.quality)},
                    {"reasons", report.reasons},
                    {"seconds", round(report.seconds)},
                    {"sets", report.sets},
                    {"lost_sets", report.lost_sets},
                    {"lost_images", report.lost_images},
                    {"residual_px", round(report.residual_px)},
                    {"longest_gap_s", round(report.longest_gap_s)}};
  json["cameras"] = ordered_json::object();
  for (const CameraFigures& camera : report.cameras) {
    json["cameras"][camera.name] = round(percent(camera.sets, report.sets));
  }
  json["subjects"] = ordered_json::array();
  for (const SubjectFigures& subject : report.subjects) {
    ordered_json one{{"name", subject.name},
                     {"tracked", round(percent(subject.tracked_sets, report.sets))},
                     {"label_changes", subject.label_changes},
                     {"residual_mm", round(1e3 * subject.residual_m)}};
    one["markers"] = ordered_json::object();
    for (const MarkerFigures& marker : subject.markers) {
      const double seen = percent(marker.seen, report.sets), filled = percent(marker.filled, report.sets);
      one["markers"][marker.name] = {{"seen", round(seen)},
                                     {"filled", round(filled)},
                                     {"lost", round(100.0 - seen - filled)},
                                     {"longest_gap_s", round(marker.longest_gap_s)}};
    }
    json["subjects"].push_back(std::move(one));
  }
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

void add_quality(TakeInfo& info, const QualityReport& report, const std::string& ended_early) {
  const std::pair<const char*, std::string> texts[] = {{kQuality, name_of(report.quality)},
                                                       {kEndedEarly, ended_early},
                                                       {kReasons, fmt::format("{}", fmt::join(report.reasons, "; "))},
                                                       {kFigures, to_json(report)}};
  for (const auto& [key, text] : texts) {
    if (text.empty()) continue;
    info.others[key] = text;
    if (!fits_on_a_full_disk(info)) info.others.erase(key);
  }
}

void remove_quality(TakeInfo& info) {
  for (const char* key : {kQuality, kEndedEarly, kReasons, kFigures}) info.others.erase(key);
}

void write_quality(const QualityReport& report, TakeHealth& into) {
  into.seconds = report.seconds;
  into.sets = report.sets;
  into.lost_sets = report.lost_sets;
  into.lost_images = report.lost_images;
  into.quality = report.quality;
  into.reasons = bounded_text<511>(fmt::format("{}", fmt::join(report.reasons, "; ")));
}

}  // namespace mocap::take
