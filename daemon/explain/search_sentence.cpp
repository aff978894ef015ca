#include <fmt/format.h>

#include <algorithm>

#include "explain/search_evidence.h"

namespace mocap::explain {
namespace {

constexpr std::size_t kMaxNames = 6;  // a longer list is cut, so that the sentence fits into a line or two
// A pixel that is brighter than the background by this many standard deviations of the noise is a marker that is too
// dim: the brightest of a million noise pixels exceeds it once in a thousand images.
constexpr double kNoiseSigmas = 6.0;
constexpr double kMinNoise_grey = 0.5;  // rounding to grey levels

// "a, b and c"; a long list ends with "and 7 more".
std::string list_of(const std::vector<std::string>& words) {
  std::string text;
  const std::size_t shown = words.size() > kMaxNames ? kMaxNames - 1 : words.size();
  for (std::size_t i = 0; i < shown; ++i) {
    const bool is_last = i + 1 == words.size();
    text += (i == 0 ? "" : is_last ? " and " : ", ") + words[i];
  }
  if (shown < words.size()) text += fmt::format(" and {} more", words.size() - shown);
  return text;
}

// "brightest pixel 9 grey, threshold 40", or what the filters rejected.
std::string levels_of(const CameraEvidence& camera) {
  const DetectionLevels& levels = camera.sight.levels;
  const bool is_filtered = camera.sight.detection.filtered() > 0 || camera.sight.detection.rows_given_up > 0;
  if (is_filtered) return fmt::format("{}", words_of_losses(camera.sight.detection));
  if (levels.brightest_grey <= 0.0) return fmt::format("threshold {:.0f}", levels.threshold_grey);
  return fmt::format("brightest pixel {:.0f} grey, threshold {:.0f}", levels.brightest_grey, levels.threshold_grey);
}

std::vector<const CameraEvidence*> blind_cameras(const SearchEvidence& evidence) {
  std::vector<const CameraEvidence*> blind;
  for (const CameraEvidence& camera : evidence.cameras) {
    if (camera.is_blind()) blind.push_back(&camera);
  }
  return blind;
}

std::string words_for_blind(const std::vector<const CameraEvidence*>& blind) {
  std::vector<std::string> words;
  for (const CameraEvidence* camera : blind) words.push_back(fmt::format("{} ({})", camera->name, levels_of(*camera)));
  return list_of(words);
}

std::vector<std::string> sighted_names(const SearchEvidence& evidence) {
  std::vector<std::string> names;
  for (const CameraEvidence& camera : evidence.cameras) {
    if (camera.is_sighted()) names.push_back(camera.name);
  }
  return names;
}

// The remedy for cameras without blobs.
std::string remedy_for_blind(const std::vector<const CameraEvidence*>& blind) {
  bool is_filtered = false, is_dim = false;
  for (const CameraEvidence* camera : blind) {
    const DetectionLevels& levels = camera->sight.levels;
    is_filtered = is_filtered || camera->sight.detection.filtered() > 0;
    is_dim = is_dim || levels.brightest_grey - levels.background_grey >
                           kNoiseSigmas * std::max(levels.noise_grey, kMinNoise_grey);
  }
  if (is_filtered) return "compare the bounds of [detect] with the size and brightness of the markers";
  if (is_dim) return "raise exposure or gain, or lower the threshold of [detect]";
  return "check lens caps, lights and exposure";
}

std::vector<std::string> missing_names(const SearchEvidence& evidence, bool only_out_of_view) {
  std::vector<std::string> names;
  for (const MissingMarker& missing : evidence.facts.missing) {
    if (only_out_of_view && missing.in_view_of >= kMinViews) continue;
    names.push_back(evidence.marker_names[missing.marker]);
  }
  return names;
}

std::string words_for_no_blobs(const SearchEvidence& evidence) {
  const auto blind = blind_cameras(evidence);
  return fmt::format("no camera sees a marker: {}; if {} is in the volume, {}", words_for_blind(blind),
                     evidence.subject, remedy_for_blind(blind));
}

std::string words_for_few_cameras(const SearchEvidence& evidence) {
  const std::vector<std::string> sighted = sighted_names(evidence);
  if (sighted.size() < evidence.views_needed) {
    const auto blind = blind_cameras(evidence);
    return fmt::format(
        "only {} {} markers, and a new marker needs {} cameras; no marker in {}: if {} is in the middle of the "
        "volume, {}",
        list_of(sighted), sighted.size() == 1 ? "sees" : "see", evidence.views_needed, words_for_blind(blind),
        evidence.subject, remedy_for_blind(blind));
  }
  const auto suspects = suspects_of(evidence);
  return fmt::format("{} markers in 3D, its set {} has {}; no marker in {} though some are in view: {}",
                     evidence.facts.points, evidence.marker_set, evidence.facts.markers, words_for_blind(suspects),
                     remedy_for_blind(suspects));
}

std::string words_for_rig(const SearchEvidence& evidence) {
  std::uint32_t least = UINT32_MAX, most = 0;
  std::vector<std::string> names;
  for (const CameraEvidence* camera : misfits_of(evidence)) {
    least = std::min(least, camera->blobs);
    most = std::max(most, camera->blobs);
    names.push_back(camera->name);
  }
  return fmt::format(
      "{} {} {} blobs, but nearly none of their rays meets others ({} markers in 3D): the rig does not fit the "
      "cameras, or the blobs are reflections; check with mocap-calibrate verify",
      list_of(names), names.size() == 1 ? "sees" : "see",
      least == most ? fmt::format("{}", most) : fmt::format("{} to {}", least, most), evidence.facts.points);
}

std::string words_for_set(const SearchEvidence& evidence) {
  const KnownSet& known = *evidence.known;
  const std::string counts = fmt::format("{} markers seen, its set {} has {}", evidence.facts.points,
                                         evidence.marker_set, evidence.facts.markers);
  return fmt::format("{}; {} fits ({} markers): set its marker_set to markersets/{}.toml", counts, known.name,
                     known.markers, known.name);
}

std::string words_for_view(const SearchEvidence& evidence) {
  if (evidence.facts.missing.empty()) {
    return fmt::format(
        "{} markers in 3D, and of a person who stands there {} cameras or more see at most {} of {} markers: move to "
        "the middle of the volume",
        evidence.facts.points, kMinViews, evidence.standing_in_view, evidence.facts.markers);
  }
  const std::vector<std::string> names = missing_names(evidence, true);
  return fmt::format("{} of {} markers are where fewer than {} cameras look ({}): move to the middle of the volume",
                     names.size(), evidence.facts.markers, kMinViews, list_of(names));
}

std::string words_for_missing(const SearchEvidence& evidence) {
  const SearchHealth& facts = evidence.facts;
  if (facts.points == 0) {
    return fmt::format("no marker in 3D without a label, its set {} has {}: is it in the volume?", evidence.marker_set,
                       facts.markers);
  }
  if (facts.missing.empty()) {
    return fmt::format("{} markers in 3D, its set {} has {} and needs {}: markers are hidden or missing{}",
                       facts.points, evidence.marker_set, facts.markers, evidence.needed,
                       evidence.is_rigid ? "" : "; stand in T-pose in the middle of the volume");
  }
  std::uint32_t least = UINT32_MAX;
  for (const MissingMarker& missing : facts.missing) least = std::min(least, missing.in_view_of);
  return fmt::format(
      "{} of {} markers are missing ({}{}), each in view of {} cameras or more: check whether they are hidden, fell "
      "off "
      "or are too dim",
      facts.missing.size(), facts.markers, evidence.is_rigid ? "" : "probably ",
      list_of(missing_names(evidence, false)), least);
}

std::string words_for_pose(const SearchEvidence& evidence) {
  const SearchHealth& facts = evidence.facts;
  const std::string counts =
      fmt::format("{} markers in 3D, its set {} has {}", facts.points, evidence.marker_set, facts.markers);
  if (evidence.is_rigid) {
    return counts + ", but their distances do not fit the set: measure the prop again, or check its marker set";
  }
  if (evidence.is_fitted) {
    return counts +
           ", but its fitted body explains them in no pose: if somebody else wears the markers, use mocapctl "
           "subject reset";
  }
  return fmt::format(
      "{}, but T-pose and A-pose explain {} of them at best: stand upright in T-pose, arms level "
      "and straight, both hands in view",
      counts, facts.explained);
}

std::string words_of(const SearchEvidence& evidence) {
  const SearchHealth& facts = evidence.facts;
  switch (facts.cause) {
    case SearchCause::None: break;
    case SearchCause::NoBlobs: return words_for_no_blobs(evidence);
    case SearchCause::FewCameras: return words_for_few_cameras(evidence);
    case SearchCause::RigDoesNotFit: return words_for_rig(evidence);
    case SearchCause::WrongMarkerSet: return words_for_set(evidence);
    case SearchCause::OutOfView: return words_for_view(evidence);
    case SearchCause::MarkersMissing: return words_for_missing(evidence);
    case SearchCause::NotStill:
      return fmt::format("{} of {} markers stand still: stand still in T-pose for {:.1f} s",
                         std::min(facts.still, facts.points), facts.points, to_s(evidence.still_for));
    case SearchCause::NoPoseFits: return words_for_pose(evidence);
    case SearchCause::Ambiguous:
      return fmt::format(
          "two poses fit its {} markers about equally well: check that the markers distinguish front from "
          "back and left from right",
          facts.points);
  }
  return {};
}

}  // namespace

std::string sentence_of(const SearchEvidence& evidence) {
  if (evidence.facts.cause == SearchCause::None) return {};
  return fmt::format("{} is not found: {}", evidence.subject, words_of(evidence));
}

}  // namespace mocap::explain
