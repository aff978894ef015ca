#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/time.h"
#include "model/search_health.h"
#include "module/search_explainer.h"

namespace mocap::explain {

/// A marker in 3D has this number of views or more. Where more cameras look, it needs `views_needed`.
inline constexpr std::uint32_t kMinViews = 2;

/// One camera at the instant of a report.
struct CameraEvidence {
  std::string name;
  bool is_in_set = false;        ///< its image is in the set
  std::uint32_t blobs = 0;       ///< in that image
  std::uint32_t in_markers = 0;  ///< of these blobs
  CameraSight sight;
  std::uint32_t points_in_view = 0;  ///< markers without a label that its image contains

  /// No blob since the last report: one image or one set may lack them by chance.
  bool is_blind() const { return delivers() && !is_sighted(); }
  bool is_sighted() const { return blobs > 0 || sight.detection.blobs > 0; }
  bool delivers() const { return is_in_set || sight.images > 0; }
};

/// A marker set other than the subject's, whose pose was found in the points.
struct KnownSet {
  std::string name;
  std::size_t markers = 0;
};

/// All facts about one subject that is not found.
struct SearchEvidence {
  std::string subject;
  std::string marker_set;
  std::vector<std::string> marker_names;
  bool is_rigid = false;
  bool is_fitted = false;
  std::uint32_t needed = 0;            ///< markers without which a search finds nothing
  std::uint32_t views_needed = 2;      ///< cameras that must see a new marker
  Duration still_for{};                ///< time to stand still
  std::uint32_t standing_in_view = 0;  ///< see standing_markers_in_view; of a rigid body all markers
  std::uint32_t candidates = 0;        ///< stationary candidate points: they count for a pose, not as markers
  SearchHealth facts;                  ///< without sentence and known set
  std::vector<CameraEvidence> cameras;
  std::optional<KnownSet> known;
};

/// The cause that the facts show, without regard to `facts.cause`. `pose_found`: a pose was found in the points.
/// `is_ambiguous`: two poses fit about equally well.
SearchCause cause_of(const SearchEvidence& evidence, bool pose_found, bool is_ambiguous);

/// The reason and a remedy in one sentence for the operator; empty if the cause is None. Every display of the reason
/// shows this sentence.
std::string sentence_of(const SearchEvidence& evidence);

/// The cameras of which far fewer blobs are views of a marker than cameras with the right model have.
std::vector<const CameraEvidence*> misfits_of(const SearchEvidence& evidence);

/// The cameras without a blob, though their images contain so many markers that not all can be hidden.
std::vector<const CameraEvidence*> suspects_of(const SearchEvidence& evidence);

}  // namespace mocap::explain
