#include "lib/simworld/scene_events.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace mocap::simworld {
namespace {

template <class Things>
std::optional<std::uint32_t> index_of(const Things& things, const std::string& name) {
  const auto found = std::ranges::find_if(things, [&](const auto& thing) { return thing.name == name; });
  if (found == things.end()) return std::nullopt;
  return static_cast<std::uint32_t>(found - things.begin());
}

Error unknown(const char* event, const char* what, const std::string& name, const std::string& of) {
  return {ErrorCode::InvalidArgument, fmt::format("{}: {} has no {} '{}'", event, of, what, name)};
}

// Of a log-normal distribution: the logarithm of its 90th percentile over its median, in standard deviations.
constexpr double kNormalP90 = 1.2815515655446004;
double log_spread(const SceneHide& hide) {
  return hide.for_p90_s > hide.for_s ? std::log(hide.for_p90_s / hide.for_s) / kNormalP90 : 0.0;
}

}  // namespace

Result<SceneEvents> SceneEvents::make(const SceneFile& scene, const std::vector<Performer>& performers,
                                      std::size_t cameras, std::uint64_t seed, bool rays) {
  SceneEvents events(scene::mixed(seed + 99));
  events.plan_blackouts(scene);
  events.plan_image_losses(scene, cameras);
  if (const Status planned = events.plan_hides(scene, performers); !planned) return planned.error();
  const Status planned = events.plan_single_views(scene, performers, cameras, rays);
  if (!planned) return planned.error();
  return events;
}

void SceneEvents::plan_blackouts(const SceneFile& scene) {
  for (const SceneBlackout& blackout : scene.blackouts) {
    double from_s = blackout.first_s;
    for (int i = 0; i < blackout.times; ++i) {
      blackouts_.push_back({from_s, from_s + blackout.for_s});
      from_s += blackout.for_s + blackout.gap_min_s + random_.uniform() * (blackout.gap_max_s - blackout.gap_min_s);
    }
  }
}

void SceneEvents::plan_image_losses(const SceneFile& scene, std::size_t cameras) {
  image_losses_.resize(cameras);
  for (const SceneImageLoss& loss : scene.image_losses) {
    double from_s = loss.first_s;
    for (int i = 0; i < loss.times; ++i) {
      const double to_s = from_s + loss.for_min_s + random_.uniform() * (loss.for_max_s - loss.for_min_s);
      for (std::vector<Span>& one : image_losses_) one.push_back({from_s, to_s + random_.uniform() * loss.return_s});
      from_s = to_s + loss.gap_s;
    }
  }
}

Status SceneEvents::plan_hides(const SceneFile& scene, const std::vector<Performer>& performers) {
  for (const Performer& performer : performers) hidden_.emplace_back(performer.actor->marker_set().markers.size());
  for (const SceneHide& wanted : scene.hides) {
    Hide& hide = hides_.emplace_back(Hide{wanted, {}});
    for (const Performer& performer : performers) {
      const MarkerSet& marker_set = performer.actor->marker_set();
      std::vector<bool>& concerned = hide.markers.emplace_back(marker_set.markers.size(), wanted.markers.empty());
      std::istringstream words(wanted.markers);
      for (std::string name; words >> name;) {
        const auto marker = index_of(marker_set.markers, name);
        if (!marker) return unknown("hide", "marker", name, marker_set.name);
        concerned[*marker] = true;
      }
    }
  }
  return {};
}

Status SceneEvents::plan_single_views(const SceneFile& scene, const std::vector<Performer>& performers,
                                      std::size_t cameras, bool rays) {
  for (const SceneOnlyCamera& wanted : scene.only_camera) {
    const auto performer = index_of(scene.actors, wanted.actor);
    MOCAP_EXPECTS(performer.has_value());  // load_scene() has checked the name
    if (static_cast<std::size_t>(wanted.camera) > cameras) {
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("only_camera: camera is {}, the rig has {}", wanted.camera, cameras)};
    }
    const MarkerSet& marker_set = performers[*performer].actor->marker_set();
    for (int i = 0; i < wanted.times; ++i) {
      SceneOnlyCamera only = wanted;
      only.from_s += i * (wanted.for_s + wanted.gap_s);
      const std::uint32_t camera = rays ? static_cast<std::uint32_t>(wanted.camera - 1) : kNone;
      if (const Status added = add_markers(only, only.markers, *performer, marker_set, camera); !added) return added;
      if (const Status added = add_markers(only, only.hidden, *performer, marker_set, kNone); !added) return added;
      if (only.bone.empty()) continue;
      const auto bone = index_of(marker_set.skeleton.bones, only.bone);
      if (!bone) return unknown("only_camera", "bone", only.bone, marker_set.name);
      watches_.push_back({{only.from_s, only.from_s + only.for_s}, *performer, *bone});
    }
  }
  return {};
}

Status SceneEvents::add_markers(const SceneOnlyCamera& only, const std::string& names, std::uint32_t performer,
                                const MarkerSet& marker_set, std::uint32_t camera) {
  std::istringstream words(names);
  for (std::string name; words >> name;) {
    const auto marker = index_of(marker_set.markers, name);
    if (!marker) return unknown("only_camera", "marker", name, marker_set.name);
    single_views_.push_back({{only.from_s, only.from_s + only.for_s}, performer, *marker, camera});
  }
  return {};
}

// Exponentially distributed time for which a marker stays visible. The mean is chosen so that the marker is hidden for
// `hide.share` of the time.
double SceneEvents::visible_s(const SceneHide& hide) {
  const double hidden_s = hide.for_s * std::exp(0.5 * std::pow(log_spread(hide), 2));
  const double mean_s = hidden_s * (1.0 - hide.share) / std::max(1e-6, hide.share);
  return -mean_s * std::log(1.0 - random_.uniform());
}

double SceneEvents::hidden_s(const SceneHide& hide) {
  const double spread = log_spread(hide);
  return spread > 0.0 ? hide.for_s * std::exp(spread * random_.normal()) : hide.for_s;
}

void SceneEvents::advance(double t_s) {
  t_s_ = t_s;
  blind_ = std::ranges::any_of(blackouts_, [&](const Span& span) { return span.has(t_s); });
  for (const Hide& hide : hides_) {
    for (std::size_t performer = 0; performer < hidden_.size(); ++performer) {
      for (std::size_t marker = 0; marker < hidden_[performer].size(); ++marker) {
        if (hide.markers[performer][marker]) advance_marker(hide.wanted, hidden_[performer][marker]);
      }
    }
  }
}

void SceneEvents::advance_marker(const SceneHide& hide, Hidden& marker) {
  if (!Span{hide.from_s, hide.to_s}.has(t_s_)) {
    marker = {};
    return;
  }
  if (marker.until_s == 0.0) {  // the first call: start in the middle of a hidden or visible interval
    marker.hidden = random_.uniform() < hide.share;
    marker.until_s = t_s_ + (marker.hidden ? hidden_s(hide) * random_.uniform() : visible_s(hide));
  }
  while (marker.until_s <= t_s_) {
    marker.hidden = !marker.hidden;
    marker.until_s += marker.hidden ? hidden_s(hide) : visible_s(hide);
  }
}

bool SceneEvents::delivers(std::uint32_t camera) const {
  return std::ranges::none_of(image_losses_[camera], [&](const Span& span) { return span.has(t_s_); });
}

bool SceneEvents::hides(std::uint32_t performer, std::uint32_t marker, std::uint32_t camera) const {
  if (hidden_[performer][marker].hidden) return true;
  return std::ranges::any_of(single_views_, [&](const OneMarker& one) {
    return one.performer == performer && one.marker == marker && one.camera != camera && one.span.has(t_s_);
  });
}

bool SceneEvents::shows(std::uint32_t performer, std::uint32_t marker, std::uint32_t camera) const {
  return std::ranges::any_of(single_views_, [&](const OneMarker& one) {
    return one.performer == performer && one.marker == marker && one.camera == camera && one.span.has(t_s_);
  });
}

}  // namespace mocap::simworld
