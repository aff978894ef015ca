#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "eval/points_score.h"

namespace mocap::eval {
namespace {

double rms_mm(const Sum& squares_m2) { return 1000.0 * std::sqrt(squares_m2.mean()); }

double per_1000(std::uint64_t count, std::uint64_t sets) {
  return sets == 0 ? 0.0 : 1000.0 * static_cast<double>(count) / static_cast<double>(sets);
}

double views_of_light(const PointsScore& s) {
  return s.lights == 0 ? 0.0 : static_cast<double>(s.views) / static_cast<double>(s.lights);
}

const char* name_of(simworld::Visibility kind) {
  return kind == simworld::Visibility::Perfect ? "perfect" : "measured";
}

}  // namespace

std::string to_json(const PointsScore& s, const std::string& motion, const simworld::WorldSettings& world, int seeds) {
  const nlohmann::ordered_json object = {{"motion", motion},
                                         {"cameras", world.cameras},
                                         {"rate_hz", world.rate_hz},
                                         {"noise_px", world.noise_px},
                                         {"misses", world.misses},
                                         {"false", world.false_blobs},
                                         {"merge", world.merge},
                                         {"visibility", name_of(world.visibility)},
                                         {"seeds", seeds},
                                         {"sets", s.sets},
                                         {"mean_views", views_of_light(s)},
                                         {"points", s.squared_error_m2.count},
                                         {"rms_mm", rms_mm(s.squared_error_m2)},
                                         {"bound_mm", rms_mm(s.bound_m2)},
                                         {"rms_merged_mm", rms_mm(s.squared_error_merged_m2)},
                                         {"rms_track_mm", rms_mm(s.squared_error_track_m2)},
                                         {"rms_coasting_mm", rms_mm(s.squared_error_coast_m2)},
                                         {"coasting", s.squared_error_coast_m2.count},
                                         {"recall_3plus", s.seen_by_3plus.value()},
                                         {"seen_3plus", s.seen_by_3plus.of},
                                         {"recall_2", s.seen_by_2_known.value()},
                                         {"seen_2", s.seen_by_2_known.of},
                                         {"recall_2_new", s.seen_by_2_new.value()},
                                         {"seen_2_new", s.seen_by_2_new.of},
                                         {"recall_merged", s.merged.value()},
                                         {"seen_merged", s.merged.of},
                                         {"recall_tracks", s.tracked.value()},
                                         {"ghosts_per_1000", per_1000(s.ghosts, s.sets)},
                                         {"point_ghosts_per_1000", per_1000(s.point_ghosts, s.sets)},
                                         {"id_changes", s.id_changes},
                                         {"id_changes_named", s.id_changes_named},
                                         {"id_changes_in_view", s.id_changes_in_view},
                                         {"initiated", s.initiated},
                                         {"nees", s.nees.mean()},
                                         {"nees_expected", 3.0},
                                         {"nees_tracks", s.nees_track.mean()},
                                         {"skipped", s.skipped}};
  return object.dump();
}

std::string to_text(const PointsScore& s) {
  std::string text = fmt::format("sets      {}, a light is seen by {:.2f} cameras\n", s.sets, views_of_light(s));
  text +=
      fmt::format("points    rms {:.4f} mm, bound {:.4f} mm, ratio {:.3f}; with merged blobs {:.3f} mm\n",
                  rms_mm(s.squared_error_m2), rms_mm(s.bound_m2),
                  rms_mm(s.squared_error_m2) / std::max(1e-12, rms_mm(s.bound_m2)), rms_mm(s.squared_error_merged_m2));
  text +=
      fmt::format("nees      {:.3f} of points, {:.3f} of tracks; 3 is expected\n", s.nees.mean(), s.nees_track.mean());
  const auto recall = [&](const char* what, const Share& share) {
    text += fmt::format("recall    {:8.4f} % of {} seen by {}\n", 100.0 * share.value(), share.of, what);
  };
  recall("3 cameras or more", s.seen_by_3plus);
  recall("exactly 2, known", s.seen_by_2_known);
  recall("exactly 2, not known", s.seen_by_2_new);
  recall("2 or more, by merged blobs", s.merged);
  text += fmt::format("tracks    {:.4f} % of {} seen by 2 or more; rms {:.4f} mm, coasting {:.2f} mm; {} initiated\n",
                      100.0 * s.tracked.value(), s.tracked.of, rms_mm(s.squared_error_track_m2),
                      rms_mm(s.squared_error_coast_m2), s.initiated);
  text += fmt::format("ghosts    {:.2f} tracks, {:.2f} points in 1000 sets\n", per_1000(s.ghosts, s.sets),
                      per_1000(s.point_ghosts, s.sets));
  text += fmt::format("ids       {} changes, {} of them of labelled markers, {} in view\n", s.id_changes,
                      s.id_changes_named, s.id_changes_in_view);
  if (s.skipped > 0) text += fmt::format("skipped   {} hypotheses: the work for one set is bounded\n", s.skipped);
  return text;
}

}  // namespace mocap::eval
