#include <algorithm>
#include <functional>

#include "explain/search_evidence.h"

namespace mocap::explain {
namespace {

// A camera does not fit the rig if less than this share of its blobs are views of a marker, relative to the largest
// number possible (most_in_markers). Measured with mocap-eval scene on walk_about, a_pose, hidden30 and crowd, seed 1
// (in parentheses seeds 2 and 3): at least 0.96 (0.96) with the right rig, at most 0.39 (0.41) with all cameras shifted
// by 0.3 m in random directions, at most 0.24 (0.29) by 1 m.
constexpr double kMisfitShare = 0.5;
// A camera with fewer blobs is not judged: they may be reflections. Chosen by hand; not yet measured.
constexpr std::uint32_t kMinMisfitBlobs = 4;
// Model: the body hides each marker in the image of a camera with probability 0.5, so all of ten with 0.5^10 = 0.001.
constexpr std::uint32_t kMinSuspectPoints = 10;

// Whether the best pose is plausible: `missing` lists its markers without a point only if the pose passes kMinPoseShare
// and kMinExplainedShare.
bool is_plausible(const SearchEvidence& evidence) {
  return evidence.facts.explained + evidence.facts.missing.size() == evidence.facts.markers;
}

std::uint32_t count_sighted(const SearchEvidence& evidence) {
  return static_cast<std::uint32_t>(std::ranges::count_if(evidence.cameras, &CameraEvidence::is_sighted));
}

bool any_blind(const SearchEvidence& evidence) {
  return std::ranges::any_of(evidence.cameras, &CameraEvidence::is_blind);
}

// Upper bound of the blobs of one camera that can be views of 3D markers. Each marker needs a blob in `views_needed`
// cameras, so the bound is the blob count of the camera with the `views_needed`-th most blobs.
std::uint32_t most_in_markers(const SearchEvidence& evidence) {
  std::vector<std::uint32_t> blobs;
  for (const CameraEvidence& camera : evidence.cameras) {
    if (camera.is_in_set) blobs.push_back(camera.blobs);
  }
  if (blobs.size() < evidence.views_needed) return 0;
  std::ranges::sort(blobs, std::greater{});
  return blobs[evidence.views_needed - 1];
}

// Whether most missing markers are where too few cameras look, or, without a plausible pose, the cameras see too few
// markers of anybody who stands where the markers are.
bool is_out_of_view(const SearchEvidence& evidence) {
  if (!is_plausible(evidence)) return evidence.standing_in_view < evidence.needed;
  const auto outside = std::ranges::count_if(
      evidence.facts.missing, [&](const MissingMarker& marker) { return marker.in_view_of < kMinViews; });
  return 2 * static_cast<std::size_t>(outside) > evidence.facts.missing.size();
}

SearchCause cause_of_too_few(const SearchEvidence& evidence) {
  if (!suspects_of(evidence).empty()) return SearchCause::FewCameras;
  if (!misfits_of(evidence).empty()) return SearchCause::RigDoesNotFit;
  return is_out_of_view(evidence) ? SearchCause::OutOfView : SearchCause::MarkersMissing;
}

}  // namespace

std::vector<const CameraEvidence*> misfits_of(const SearchEvidence& evidence) {
  std::vector<const CameraEvidence*> misfits;
  const std::uint32_t most = most_in_markers(evidence);
  for (const CameraEvidence& camera : evidence.cameras) {
    const std::uint32_t expected = std::min(camera.blobs, most);
    if (camera.is_in_set && expected >= kMinMisfitBlobs && camera.in_markers < kMisfitShare * expected) {
      misfits.push_back(&camera);
    }
  }
  return misfits;
}

std::vector<const CameraEvidence*> suspects_of(const SearchEvidence& evidence) {
  std::vector<const CameraEvidence*> suspects;
  for (const CameraEvidence& camera : evidence.cameras) {
    if (camera.is_blind() && camera.points_in_view >= kMinSuspectPoints) suspects.push_back(&camera);
  }
  return suspects;
}

SearchCause cause_of(const SearchEvidence& evidence, bool pose_found, bool is_ambiguous) {
  const SearchHealth& facts = evidence.facts;
  const std::uint32_t sighted = count_sighted(evidence);
  const bool is_still = evidence.is_rigid || evidence.is_fitted || facts.still + evidence.candidates >= evidence.needed;
  if (sighted == 0) return SearchCause::NoBlobs;
  if (pose_found && !evidence.is_fitted) return is_still ? SearchCause::None : SearchCause::NotStill;
  if (facts.points < evidence.needed && sighted < evidence.views_needed && any_blind(evidence)) {
    return SearchCause::FewCameras;
  }
  if (evidence.known) return SearchCause::WrongMarkerSet;
  if (facts.points < evidence.needed && facts.explained < evidence.needed) return cause_of_too_few(evidence);
  if (!is_still) return SearchCause::NotStill;
  return is_ambiguous ? SearchCause::Ambiguous : SearchCause::NoPoseFits;
}

}  // namespace mocap::explain
