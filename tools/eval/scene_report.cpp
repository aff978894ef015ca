#include "eval/scene_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "lib/scoring/figures.h"

namespace mocap::eval {
namespace {

using Json = nlohmann::ordered_json;

scoring::LabelCounts all_labels(const SceneOutcome& clip) {
  scoring::LabelCounts all;
  for (const auto& [id, counts] : clip.labels) all.add(counts);
  return all;
}

scoring::SkeletonCounts all_bones(const SceneOutcome& clip) {
  scoring::SkeletonCounts all;
  for (const auto& [id, counts] : clip.bones) all.add(counts);
  return all;
}

scoring::LabelCounts all_labels(const SceneResults& results) {
  scoring::LabelCounts all;
  for (const SceneOutcome& clip : results.clips) all.add(all_labels(clip));
  return all;
}

scoring::SkeletonCounts all_bones(const SceneResults& results) {
  scoring::SkeletonCounts all;
  for (const SceneOutcome& clip : results.clips) all.add(all_bones(clip));
  return all;
}

scoring::ClearMot::Counts all_mot(const SceneResults& results) {
  scoring::ClearMot::Counts all;
  for (const SceneOutcome& clip : results.clips) {
    all.objects += clip.mot.objects;
    all.predictions += clip.mot.predictions;
    all.matches += clip.mot.matches;
    all.switches += clip.mot.switches;
    all.misses += clip.mot.misses;
    all.false_positives += clip.mot.false_positives;
    all.distance += clip.mot.distance;
  }
  return all;
}

std::optional<double> watched_rms_mm(const std::vector<SceneOutcome>& clips) {
  double squares_m2 = 0.0, count = 0.0;
  for (const SceneOutcome& clip : clips) {
    squares_m2 += clip.watched_squares_m2;
    count += static_cast<double>(clip.watched);
  }
  if (count == 0.0) return std::nullopt;
  return 1000.0 * std::sqrt(squares_m2 / count);
}

std::optional<double> ray_gain(const SceneResults& results) {
  const auto with = watched_rms_mm(results.clips), without = watched_rms_mm(results.without_rays);
  if (!with || !without || *with <= 0.0) return std::nullopt;
  return *without / *with;
}

// The worst value of a figure over all clips. Empty if a clip lacks the figure.
template <class Figure>
std::optional<double> worst(const SceneResults& results, bool least, Figure figure) {
  std::optional<double> found;
  for (const SceneOutcome& clip : results.clips) {
    const std::optional<double> value = figure(clip);
    if (!value) return std::nullopt;
    found = !found ? *value : least ? std::min(*found, *value) : std::max(*found, *value);
  }
  return found;
}

std::optional<double> worst_f1(const SceneResults& r) {
  return worst(r, true, [](const SceneOutcome& c) { return all_labels(c).f1(); });
}
std::optional<double> worst_availability(const SceneResults& r) {
  return worst(r, true, [](const SceneOutcome& c) { return all_labels(c).availability(); });
}
std::optional<double> worst_wrong_sets(const SceneResults& r) {
  return worst(r, false, [](const SceneOutcome& c) {
    return std::optional(static_cast<double>(all_labels(c).longest_wrong_sets));
  });
}
std::optional<double> worst_joint_rms_mm(const SceneResults& r) {
  return worst(r, false, [](const SceneOutcome& c) { return all_bones(c).joint_rms_mm(); });
}
std::optional<double> worst_rotation_rms_deg(const SceneResults& r) {
  return worst(r, false, [](const SceneOutcome& c) { return all_bones(c).rotation_rms_deg(); });
}
std::optional<double> worst_hidden_rms_mm(const SceneResults& r) {
  return worst(r, false, [](const SceneOutcome& c) { return all_bones(c).hidden_joint_rms_mm(); });
}

Json bones_json(const SceneOutcome& clip, std::uint32_t id) {
  Json bones = Json::array();
  for (const auto& [bone, counts] : clip.each_bone.at(id)) {
    bones.push_back({{"bone", clip.bone_names[id][bone]},
                     {"joint_rms_mm", scoring::or_null(counts.joint_rms_mm())},
                     {"rotation_rms_deg", scoring::or_null(counts.rotation_rms_deg())},
                     {"turn_told", bool{clip.rotation_observability[id][bone]}}});
  }
  return bones;
}

Json clip_json(const SceneOutcome& clip) {
  Json object;
  object["clip"] = clip.clip;
  scoring::put(object, all_labels(clip));
  scoring::put(object, all_bones(clip));
  scoring::put(object, clip.mot);
  object["sets"] = clip.sets;
  object["unlabelled"] = clip.unlabelled;
  object["ghosts"] = clip.ghosts;
  object["pipeline_us_per_set"] = 1e6 * clip.pipeline_s / static_cast<double>(std::max<std::uint64_t>(clip.sets, 1));
  object["world_us_per_set"] = 1e6 * clip.world_s / static_cast<double>(std::max<std::uint64_t>(clip.sets, 1));
  object["subjects"] = Json::array();
  for (std::uint32_t id = 0; id < clip.subjects.size(); ++id) {
    Json subject;
    subject["subject"] = clip.subjects[id];
    if (clip.labels.contains(id)) scoring::put(subject, clip.labels.at(id));
    if (clip.bones.contains(id)) scoring::put(subject, clip.bones.at(id));
    if (clip.each_bone.contains(id)) subject["bones"] = bones_json(clip, id);
    object["subjects"].push_back(std::move(subject));
  }
  return object;
}

std::string row_text(const std::string& who, const scoring::LabelCounts& l, const scoring::SkeletonCounts& b,
                     const std::string& rest) {
  return fmt::format("{:<34} {:>7} {:>7} {:>7} {:>6} {:>7} {:>7} {:>6} {:>6} {:>7} {:>7} {:>6} {:>7} {:>7} {}\n", who,
                     scoring::cell(l.precision(), 5), scoring::cell(l.recall(), 4), scoring::cell(l.f1(), 4),
                     l.wrong_events, l.longest_wrong_sets, scoring::cell(l.availability(), 4),
                     scoring::cell(scoring::first_label_s(l), 2), scoring::cell(l.reacquire_p95_s(), 2),
                     scoring::cell(b.joint_rms_mm(), 2), scoring::cell(b.rotation_rms_deg(), 2),
                     scoring::cell(b.jitter_mm(), 3), scoring::cell(b.hidden_joint_rms_mm(), 1),
                     scoring::cell(l.marker_rms_mm(), 2), rest);
}

// Lists the bones whose rotation is not fully observable, for each subject.
std::string unobservable_text(const SceneResults& results) {
  std::string text;
  if (results.clips.empty()) return text;
  const SceneOutcome& clip = results.clips.front();
  for (std::size_t id = 0; id < clip.subjects.size(); ++id) {
    std::string bones;
    for (std::size_t b = 0; b < clip.bone_names[id].size(); ++b) {
      if (!clip.rotation_observability[id][b]) bones += " " + clip.bone_names[id][b];
    }
    if (!bones.empty()) text += fmt::format("{}: rotation not fully observable:{}\n", clip.subjects[id], bones);
  }
  if (text.empty()) return text;
  const scoring::SkeletonCounts all = all_bones(results);
  return text + fmt::format("rotation: rms {} deg of fully observable bones, {} deg of the others\n",
                            scoring::cell(all.rotation_observable_deg(), 2),
                            scoring::cell(all.rotation_unobservable_deg(), 2));
}

std::string short_name(const std::string& path) { return path.substr(path.rfind('/') + 1); }

}  // namespace

std::vector<GoalMet> goals_of(const simworld::SceneFile& scene, const SceneResults& results) {
  std::vector<GoalMet> all;
  const auto ask = [&](const char* key, const std::optional<double>& goal, const std::optional<double>& value,
                       bool at_least) {
    if (!goal) return;
    all.push_back({key, *goal, value, value && (at_least ? *value >= *goal : *value <= *goal)});
  };
  const simworld::SceneGoal& goal = scene.goal;
  const scoring::LabelCounts labels = all_labels(results);
  ask("f1", goal.f1, worst_f1(results), true);
  ask("availability", goal.availability, worst_availability(results), true);
  ask("longest_wrong_sets", goal.longest_wrong_sets, worst_wrong_sets(results), false);
  ask("joint_rms_mm", goal.joint_rms_mm, worst_joint_rms_mm(results), false);
  ask("rotation_rms_deg", goal.rotation_rms_deg, worst_rotation_rms_deg(results), false);
  ask("hidden_joint_rms_mm", goal.hidden_joint_rms_mm, worst_hidden_rms_mm(results), false);
  ask("reacquired_share", goal.reacquired_share, labels.reacquired_share(0.5), true);
  ask("exchanges", goal.exchanges, static_cast<double>(labels.exchanged), false);
  ask("ray_gain", goal.ray_gain, ray_gain(results), true);
  return all;
}

std::string to_json(const simworld::SceneFile& scene, const SceneResults& results) {
  Json object;
  object["scene"] = scene.path.string();
  scoring::put(object, all_labels(results));
  scoring::put(object, all_bones(results));
  scoring::put(object, all_mot(results));
  std::uint64_t ghosts = 0;
  for (const SceneOutcome& clip : results.clips) ghosts += clip.ghosts;
  object["ghosts"] = ghosts;
  object["watched_joint_rms_mm"] = scoring::or_null(watched_rms_mm(results.clips));
  object["ray_gain"] = scoring::or_null(ray_gain(results));
  object["worst"] = {{"f1", scoring::or_null(worst_f1(results))},
                     {"availability", scoring::or_null(worst_availability(results))},
                     {"longest_wrong_sets", scoring::or_null(worst_wrong_sets(results))},
                     {"joint_rms_mm", scoring::or_null(worst_joint_rms_mm(results))},
                     {"rotation_rms_deg", scoring::or_null(worst_rotation_rms_deg(results))}};
  object["goals"] = Json::array();
  for (const GoalMet& goal : goals_of(scene, results)) {
    object["goals"].push_back(
        {{"key", goal.key}, {"goal", goal.goal}, {"value", scoring::or_null(goal.value)}, {"met", goal.met}});
  }
  object["skipped"] = results.skipped;
  object["clips"] = Json::array();
  for (const SceneOutcome& clip : results.clips) object["clips"].push_back(clip_json(clip));
  return object.dump();
}

std::string to_text(const simworld::SceneFile& scene, const SceneResults& results) {
  std::string text = scene.about.empty() ? "" : scene.about + "\n";
  text += fmt::format("{:<34} {:>7} {:>7} {:>7} {:>6} {:>7} {:>7} {:>6} {:>6} {:>7} {:>7} {:>6} {:>7} {:>7} {}\n",
                      "clip", "prec", "recall", "f1", "wrong", "longest", "avail", "1st s", "reacq", "joint", "rot deg",
                      "jitter", "hidden", "marker", "ghosts  us/set");
  for (const SceneOutcome& clip : results.clips) {
    const std::string rest =
        fmt::format("{:>6}  {:.0f}", clip.ghosts,
                    1e6 * clip.pipeline_s / static_cast<double>(std::max<std::uint64_t>(clip.sets, 1)));
    text += row_text(clip.clip.empty() ? "scene" : short_name(clip.clip), all_labels(clip), all_bones(clip), rest);
    for (std::uint32_t id = 0; clip.subjects.size() > 1 && id < clip.subjects.size(); ++id) {
      const auto labels = clip.labels.find(id);
      const auto bones = clip.bones.find(id);
      text += row_text("  " + clip.subjects[id], labels == clip.labels.end() ? scoring::LabelCounts{} : labels->second,
                       bones == clip.bones.end() ? scoring::SkeletonCounts{} : bones->second, "");
    }
  }
  if (results.clips.size() > 1) text += row_text("all", all_labels(results), all_bones(results), "");
  if (const scoring::LabelCounts all = all_labels(results); !all.reacquire_s.empty()) {
    text +=
        fmt::format("labelled again within 0.5 s after {} of {} blackouts\n",
                    std::ranges::count_if(all.reacquire_s, [](double s) { return s <= 0.5; }), all.reacquire_s.size());
  }
  if (const auto with = watched_rms_mm(results.clips)) {
    text += fmt::format("watched joint: rms {} mm, without the ray {} mm, {} times less\n", scoring::cell(with, 1),
                        scoring::cell(watched_rms_mm(results.without_rays), 1), scoring::cell(ray_gain(results), 2));
  }
  text += unobservable_text(results);
  for (const std::string& motion : results.skipped) text += fmt::format("skipped: {}\n", motion);
  for (const GoalMet& goal : goals_of(scene, results)) {
    text += fmt::format("{:<7} {} = {} (goal {})\n", goal.met ? "met" : "MISSED", goal.key,
                        scoring::cell(goal.value, 4), goal.goal);
  }
  return text;
}

std::string wrong_text(const SceneResults& results, std::size_t most) {
  std::string text;
  for (const SceneOutcome& clip : results.clips) {
    std::vector<scoring::WrongEvent> events = clip.wrong;
    std::ranges::stable_sort(
        events, [](const scoring::WrongEvent& a, const scoring::WrongEvent& b) { return a.sets > b.sets; });
    if (events.size() > most) events.resize(most);
    for (const scoring::WrongEvent& event : events) {
      const std::string on =
          event.on ? clip.subjects[event.on->subject] + "'s " + clip.marker_names[event.on->subject][event.on->marker]
                   : "no marker";
      text += fmt::format("wrong: {:<24} {} {} at {:.3f} s for {} sets, up to {:.0f} mm off, on {}\n",
                          short_name(clip.clip), clip.subjects[event.subject],
                          clip.marker_names[event.subject][event.marker], event.from_s, event.sets,
                          1000.0 * event.farthest_m, on);
    }
  }
  return text;
}

std::string reasons_text(const SceneResults& results) {
  std::string text;
  for (const SceneOutcome& clip : results.clips) {
    for (const SearchReason& reason : clip.reasons) {
      text += fmt::format("reason: {:<24} {:7.2f} s {}\n", short_name(clip.clip), reason.t_s, reason.sentence);
    }
  }
  return text;
}

}  // namespace mocap::eval
