#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/blob.h"
#include "model/sighting.h"

namespace mocap::associate {

/// Whose marker each 2D track of a camera was: the camera's own tracker tells that a blob is what it was in the last
/// image, and the last sets told which marker that is. Never allocates after construction.
///
/// Where the 2D track of a marker that one camera alone sees breaks, the camera's next blob near by is rather that
/// marker's than one that it has not seen for long.
///
/// A 2D track may leap to another marker: the views that agree on a point have the last word. A marker whose 3D track
/// ended, because one camera alone sees it, is known by its name.
class BlobTrackOwners {
 public:
  static constexpr std::uint32_t kUnknown = 0xFFFF'FFFF;      ///< not known
  static constexpr std::uint32_t kUnpredicted = 0xFFFF'FFFE;  ///< of a marker that nobody expects now

  explicit BlobTrackOwners(std::size_t camera_count);

  /// Takes in who is expected in this set. Tracks come in the order of their ids.
  void set_predictions(const Expected& expected);

  /// Takes in that this camera's next image has come: before it is asked about its blobs.
  void begin_image(CameraId camera) { ++images_[camera.value]; }

  /// Takes in that this camera alone sees this expected marker in its last image.
  void note_bearing_only(CameraId camera, std::uint32_t marker);
  /// The expected markers that it alone saw a moment ago.
  std::span<const std::uint32_t> recent_bearing_only(CameraId camera);

  /// Index in Expected::markers of the owner, or kUnknown or kUnpredicted. Asked once an image about each blob: a 2D
  /// track that was not in the image before has found some blob again, nobody knows which.
  std::uint32_t predicted_marker(CameraId camera, BlobTrackId blob);

  /// The blob is surely this expected marker's.
  void associate(CameraId camera, BlobTrackId blob, std::uint32_t marker);

 private:
  // A power of two; a newer 2D track takes the place of one that many older.
  static constexpr std::size_t kTableSize = 1024;
  // Sets in which the views agreed, until a 2D track is believed; more are not counted.
  static constexpr std::uint32_t kConfirmSets = 3;

  struct Entry {
    BlobTrackId blob;
    TrackId owner;  // and its name: either may be nobody's
    Label label;
    std::uint32_t sets = 0;
    std::uint32_t image = 0;  // the last that it was in
  };
  struct RecentBearing {
    Label label;
    std::uint32_t image = 0;  // the last
  };
  struct TrackIndexEntry {
    TrackId track;
    std::uint32_t marker;
  };

  // The expected marker of that name, or kUnpredicted.
  std::uint32_t marker_of(Label label) const;

  std::vector<Entry> entries_;                      // of camera * kTableSize + blob track's last bits
  std::vector<std::uint32_t> images_;               // by camera: how many came
  std::vector<std::vector<RecentBearing>> recent_;  // by camera
  std::vector<std::uint32_t> recent_bearing_only_;  // of the camera asked about last
  std::vector<TrackIndexEntry> track_index_;        // by track
  std::vector<TrackId> track_of_;                   // by marker
  std::vector<Label> label_of_;                     // by marker
};

}  // namespace mocap::associate
