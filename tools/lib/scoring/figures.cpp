#include "lib/scoring/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace mocap::scoring {

nlohmann::ordered_json or_null(const std::optional<double>& figure) {
  if (!figure) return nullptr;
  return *figure;
}

std::optional<double> first_label_s(const LabelCounts& labels) {
  if (labels.first_label_s.empty()) return std::nullopt;
  return *std::ranges::max_element(labels.first_label_s);
}

void put(nlohmann::ordered_json& into, const LabelCounts& l) {
  into["precision"] = or_null(l.precision());
  into["recall"] = or_null(l.recall());
  into["f1"] = or_null(l.f1());
  into["wrong_events"] = l.wrong_events;
  into["longest_wrong_sets"] = l.longest_wrong_sets;
  into["availability"] = or_null(l.availability());
  into["first_label_s"] = or_null(first_label_s(l));
  into["reacquire_s"] = or_null(l.reacquire_p95_s());
  into["outages"] = l.reacquire_s.size();
  into["reacquired_share"] = or_null(l.reacquired_share(0.5));
  into["labels_right"] = l.right;
  into["labels_wrong"] = l.wrong;
  into["labels_exchanged"] = l.exchanged;
  into["labels_unjudged"] = l.unjudged;
  into["labels_visible"] = l.visible;
  into["filled"] = l.filled;
  into["filled_off"] = l.filled_off;
  into["marker_rms_mm"] = or_null(l.marker_rms_mm());
  into["filled_rms_mm"] = or_null(l.filled_rms_mm());
  into["sets_judged"] = l.sets;
}

void put(nlohmann::ordered_json& into, const SkeletonCounts& b) {
  into["joint_rms_mm"] = or_null(b.joint_rms_mm());
  into["joint_max_mm"] = b.joints > 0 ? nlohmann::ordered_json(1000.0 * b.max_m) : nlohmann::ordered_json(nullptr);
  into["rotation_rms_deg"] = or_null(b.rotation_rms_deg());
  into["rotation_told_deg"] = or_null(b.rotation_observable_deg());
  into["rotation_untold_deg"] = or_null(b.rotation_unobservable_deg());
  into["jitter_mm"] = or_null(b.jitter_mm());
  into["hidden_joint_rms_mm"] = or_null(b.hidden_joint_rms_mm());
  into["hidden_joints"] = b.hidden_joints;
}

void put(nlohmann::ordered_json& into, const ClearMot::Counts& mot) {
  into["mota"] = or_null(mot.mota());
  into["motp_mm"] = mot.motp() ? nlohmann::ordered_json(1000.0 * *mot.motp()) : nlohmann::ordered_json(nullptr);
  into["mot_matches"] = mot.matches;
  into["mot_switches"] = mot.switches;
  into["mot_misses"] = mot.misses;
  into["mot_false_positives"] = mot.false_positives;
}

std::string cell(const std::optional<double>& figure, int digits) {
  if (!figure) return "-";
  if (!std::isfinite(*figure)) return "never";
  return fmt::format("{:.{}f}", *figure, digits);
}

}  // namespace mocap::scoring
