#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/bounds.h"
#include "model/ids.h"
#include "model/points.h"

namespace mocap {

/// Why a subject is not found. The order is that of the wire.
enum class SearchCause {
  None,            ///< no reason: the subject is about to be found
  NoBlobs,         ///< no camera sees a marker
  FewCameras,      ///< cameras see no marker, and the others are too few
  RigDoesNotFit,   ///< cameras see markers, but their rays do not meet
  WrongMarkerSet,  ///< another known marker set fits better
  OutOfView,       ///< the subject is partly outside the volume that enough cameras see
  MarkersMissing,  ///< markers are hidden, fell off or are too dim
  NotStill,        ///< enough markers, but they move
  NoPoseFits,      ///< enough markers, but no T-pose or A-pose (a fitted body: no pose) fits them
  Ambiguous,       ///< two poses fit about equally well
};
inline constexpr int kSearchCauses = 10;

/// A marker of the set that the best pose leaves without a point.
struct MissingMarker {
  std::uint32_t marker = 0;      ///< index in the marker set
  WorldPoint position;           ///< in the best pose, within about 0.1 m for a person who is not fitted
  std::uint32_t in_view_of = 0;  ///< number of cameras whose images contain the position
};

/// The reason why a subject is not found, as Health has it. In place: a copy does not allocate.
struct SearchHealth {
  SubjectId subject;
  SearchCause cause = SearchCause::None;
  std::uint32_t points = 0;     ///< confirmed markers in 3D without a label
  std::uint32_t still = 0;      ///< stationary ones among them
  std::uint32_t markers = 0;    ///< markers of the set
  std::uint32_t explained = 0;  ///< markers of the set that have a point in the best pose
  BoundedVector<MissingMarker, kMaxLabels> missing;
  BoundedVector<char, 63> known_set;  ///< name of the known marker set that is nearest; empty: none
  std::uint32_t known_set_markers = 0;
  BoundedVector<char, 511> sentence;  ///< for the operator, with the subject's name and a remedy; empty: no reason
};

/// Text of a bounded string.
template <std::size_t Capacity>
std::string_view text_of(const BoundedVector<char, Capacity>& from) {
  return {from.data(), from.size()};
}

/// A bounded string, cut at its capacity before the first byte of a UTF-8 character that does not fit.
template <std::size_t Capacity>
BoundedVector<char, Capacity> bounded_text(std::string_view text) {
  std::size_t size = text.size() < Capacity ? text.size() : Capacity;
  while (size < text.size() && size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0U) == 0x80U) --size;
  BoundedVector<char, Capacity> into;
  for (const char c : text.substr(0, size)) into.push_back(c);
  return into;
}

}  // namespace mocap
