#include "calibration/wand/join_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

// Of the samples that two cameras share: with fewer that agree it is chance.
constexpr double kLeastShare = 0.3;
constexpr double kSureShare = 0.7;

struct Edge {
  std::size_t a;
  std::size_t b;
  Relation relation;
  double worth;  // samples that agree, by the sine of the angle at which the cameras see them
};

std::vector<WandPair> pairs_of(const WandViews& views, std::size_t a, std::size_t b) {
  std::vector<WandPair> pairs;
  for (std::size_t i = 0; i < views.instants.size(); ++i) {
    if (views.of[a][i] && views.of[b][i]) pairs.push_back({views.of[a][i]->rays, views.of[b][i]->rays});
  }
  return pairs;
}

WandRefusal too_few(const Rig& rig, const std::vector<std::size_t>& shared, const WandSettings& settings) {
  const auto worst = std::ranges::min_element(shared);
  const auto camera = static_cast<std::size_t>(worst - shared.begin());
  return {WandFault::TooFewSamples,
          fmt::format("camera '{}': {} samples that another camera shares, expected {} at least; wave {} more where it "
                      "and another camera look",
                      rig[camera].name, *worst, settings.least_samples,
                      static_cast<std::size_t>(settings.least_samples) - *worst)};
}

// As pairs_of, with b's images turned round as in a mirror.
std::vector<WandPair> mirrored_pairs_of(const WandViews& views, const Rig& rig, std::size_t a, std::size_t b,
                                        std::size_t marks) {
  std::vector<WandPair> pairs;
  for (std::size_t i = 0; i < views.instants.size(); ++i) {
    if (!views.of[a][i] || !views.of[b][i]) continue;
    WandPair pair{views.of[a][i]->rays, views.of[b][i]->rays};
    bool told = true;
    for (std::size_t m = 0; m < marks && told; ++m) {
      const auto spot = static_cast<std::size_t>(views.of[b][i]->spots[m]);
      PixelPoint at = views.picture(b, i)->spots[spot].at;
      at.v.x() = rig[b].width_px - 1 - at.v.x();
      const auto ray = geometry::undistort(rig[b].lens, at);
      told = ray.has_value();
      if (told) pair.b.ray[m] = ray->v;
    }
    if (told) pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace

std::optional<WandRefusal> refuse_mirrored(const WandViews& views, const Rig& start, std::size_t camera,
                                           const Wand& wand, const WandSettings& settings, double reach_px) {
  for (std::size_t other = 0; other < start.size(); ++other) {
    if (other == camera) continue;
    const std::vector<WandPair> pairs = mirrored_pairs_of(views, start, other, camera, wand.marks_m.size());
    if (pairs.size() < static_cast<std::size_t>(settings.least_samples)) continue;
    const auto relation = relate(pairs, wand, reach_px / std::min(start[camera].lens.fx_px, start[other].lens.fx_px));
    if (!relation || relation->share < kSureShare) continue;
    return WandRefusal{
        WandFault::Mirrored,
        fmt::format("camera '{}': its images are mirrored: {:.0f} % of what it and '{}' saw agrees only with left and "
                    "right exchanged; switch off its ReverseX or ReverseY, or take the mirror away",
                    start[camera].name, 100.0 * relation->share, start[other].name)};
  }
  return std::nullopt;
}

Result<Rig, WandRefusal> join_cameras(const WandViews& views, const Rig& start, const Wand& wand,
                                      const WandSettings& settings, double reach_px, const Progress& progress) {
  const std::size_t n = start.size();
  std::vector<Edge> edges;
  std::vector<std::size_t> shared(n, 0);
  std::size_t done = 0;
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = a + 1; b < n; ++b) {
      if (progress && !progress("relating cameras", static_cast<double>(done++) / static_cast<double>(n * (n - 1) / 2)))
        return WandRefusal{WandFault::NoSolution, "ended before there was a solution"};
      const std::vector<WandPair> pairs = pairs_of(views, a, b);
      shared[a] = std::max(shared[a], pairs.size());
      shared[b] = std::max(shared[b], pairs.size());
      if (pairs.size() < static_cast<std::size_t>(settings.least_samples)) continue;
      const double f = std::min(start[a].lens.fx_px, start[b].lens.fx_px);
      const auto relation = relate(pairs, wand, reach_px / f);
      if (!relation || relation->share < kLeastShare) continue;
      const double agreeing = relation->share * static_cast<double>(pairs.size());
      edges.push_back({a, b, *relation, agreeing * std::sin(relation->angle_rad)});
    }
  }
  if (std::ranges::all_of(shared, [](std::size_t some) { return some > 0; }) &&
      std::ranges::any_of(shared,
                          [&](std::size_t some) { return some < static_cast<std::size_t>(settings.least_samples); }))
    return too_few(start, shared, settings);

  Rig rig = start;
  rig[0].camera_from_world = {};
  std::vector<bool> placed(n, false);
  placed[0] = true;
  for (std::size_t count = 1; count < n; ++count) {
    const Edge* best = nullptr;
    for (const Edge& edge : edges) {
      if (placed[edge.a] != placed[edge.b] && (best == nullptr || edge.worth > best->worth)) best = &edge;
    }
    if (best == nullptr) break;
    if (placed[best->a]) {
      rig[best->b].camera_from_world = best->relation.b_from_a * rig[best->a].camera_from_world;
    } else {
      rig[best->a].camera_from_world = best->relation.b_from_a.inverse() * rig[best->b].camera_from_world;
    }
    placed[best->a] = placed[best->b] = true;
  }
  for (std::size_t c = 0; c < n; ++c) {
    if (placed[c]) continue;
    if (auto mirrored = refuse_mirrored(views, start, c, wand, settings, reach_px)) return *mirrored;
  }
  std::string missing;
  for (std::size_t c = 0; c < n; ++c) {
    if (!placed[c])
      missing += fmt::format("{}'{}' ({} samples shared)", missing.empty() ? "" : ", ", start[c].name, shared[c]);
  }
  if (!missing.empty()) {
    return WandRefusal{
        WandFault::NoOverlap,
        fmt::format("no overlap that agrees with the other cameras: {}; wave the wand where each of these "
                    "and another camera look at once, and see that all cameras are synchronised",
                    missing)};
  }
  return rig;
}

}  // namespace mocap::calibration
