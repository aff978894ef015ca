#include "eval/points_ghosts.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace mocap::eval {
namespace {

// The marker that was associated with the track in this set.
const Marker* marker_of(const TrackedMarker& track, const Markers& markers) {
  const auto same = [&](const Marker& m) { return m.residual_px == track.residual_px && m.cameras == track.cameras; };
  const auto found = std::ranges::find_if(markers, same);
  return found == markers.end() ? nullptr : found;
}

std::string lights_of(const Match& match, const simworld::SeenInstant& truth, const FrameSet& set) {
  std::string text;
  for (const BlobRef& seen : match.sightings) {
    const std::uint32_t camera = set.views[seen.view]->camera.value;
    const auto& lights = truth.lights_in[camera][seen.blob];
    text += fmt::format(" {}:{}", camera, lights.empty() ? "false" : fmt::format("{}", fmt::join(lights, "+")));
    const BlobTrackId id = set.views[seen.view]->blobs[seen.blob].track;
    if (id.names_something()) text += fmt::format("#{}", id.value);
    if (seen.off_x_px != 0.0F || seen.off_y_px != 0.0F) text += "~";
  }
  return text;
}

}  // namespace

std::string describe_ghosts(int set, const simworld::SeenInstant& truth, const MarkerPipeline& pipeline,
                            const PointsScorer& scorer) {
  std::string text;
  for (const TrackedMarker* track : scorer.ghosts()) {
    std::size_t nearest = 0;
    double least_m = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < truth.lights.size(); ++i) {
      const double away_m = (truth.lights[i].position - track->position.v).norm();
      if (!truth.lights[i].there || away_m >= least_m) continue;
      least_m = away_m;
      nearest = i;
    }
    const Marker* marker = marker_of(*track, pipeline.markers());
    const bool predicted = marker != nullptr && marker->prediction != Match::kNew;
    text += fmt::format(
        "set {} track {} age {} {} sigma {:.1f} mm, rms {:.2f} px, {:.1f} mm off {} (track {}, {} alone, {} merged):",
        set, track->id.value, track->age_sets, predicted ? "predicted" : "new",
        1000.0 * std::sqrt(track->covariance_m2.trace()), track->residual_px, 1000.0 * least_m, nearest,
        scorer.last_track(nearest), std::popcount(truth.alone_in[nearest]), std::popcount(truth.merged_in[nearest]));
    if (marker != nullptr) text += lights_of(pipeline.matches().matches[marker->match], truth, pipeline.set());
    text += "\n";
  }
  return text;
}

std::string describe_misses(int set, const simworld::SeenInstant& truth, const MarkerPipeline& pipeline,
                            const PointsScorer& scorer) {
  std::string text;
  for (const std::size_t light : scorer.missed()) {
    const std::uint32_t track = scorer.last_track(light);
    const auto prediction =
        std::ranges::find_if(pipeline.predicted().markers, [&](const auto& m) { return m.track.value == track; });
    text += fmt::format("missed in set {}: {} of track {}", set, light, track);
    if (prediction != pipeline.predicted().markers.end()) {
      text += fmt::format(", predicted {:.1f} mm off, sigma {:.1f} mm",
                          1000.0 * (prediction->position.v - truth.lights[light].position).norm(),
                          1000.0 * std::sqrt(prediction->covariance_m2.trace()));
    }
    for (std::size_t view = 0; view < pipeline.set().views.size(); ++view) {
      const BlobFrame& frame = *pipeline.set().views[view];
      const auto& lights_in = truth.lights_in[frame.camera.value];
      for (std::size_t blob = 0; blob < lights_in.size(); ++blob) {
        if (std::ranges::find(lights_in[blob], light) == lights_in[blob].end()) continue;
        text += fmt::format("; camera {}", frame.camera.value);
        if (frame.blobs[blob].track.names_something()) text += fmt::format("#{}", frame.blobs[blob].track.value);
        for (const Match& match : pipeline.matches().matches) {
          const auto holds = [&](const BlobRef& seen) { return seen.view == view && seen.blob == blob; };
          if (std::ranges::none_of(match.sightings, holds)) continue;
          text += match.prediction == Match::kNew
                      ? fmt::format(" new by {} views", match.sightings.size())
                      : fmt::format(" track {} by {} views", pipeline.predicted().markers[match.prediction].track.value,
                                    match.sightings.size());
        }
        for (const BearingOnlyObservation& bearing_only : pipeline.matches().bearing_only) {
          if (bearing_only.sighting.view == view && bearing_only.sighting.blob == blob)
            text += fmt::format(" alone track {}", pipeline.predicted().markers[bearing_only.prediction].track.value);
        }
      }
    }
    text += "\n";
  }
  return text;
}

}  // namespace mocap::eval
