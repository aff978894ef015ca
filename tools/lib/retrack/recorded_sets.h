#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "lib/retrack/set_source.h"

namespace mocap::retrack {

/// The sets that the daemon formed and fused, as the snapshots of the take name them: sets that it passed over are left
/// out, and images that came too late are in no set.
class RecordedSets : public SetSource {
 public:
  /// `camera_ids`: for each camera of the take its id in the settings; an id that names nothing leaves the camera out.
  /// `camera_count`: cameras of the settings.
  RecordedSets(std::vector<CameraId> camera_ids, std::uint32_t camera_count);

  /// The frames have the ids of the settings.
  void add(const BlobFrame& frame) override;
  void add(RecordedSnapshot snapshot) override;
  std::optional<TakeSet> next(Timestamp read_up_to) override;

 private:
  static Timestamp last_exposure(const v1::Snapshot& snapshot);
  const BlobFrame* find(CameraId camera, std::uint64_t number, Timestamp exposed_at);
  void add_view(TakeSet& set, const v1::Views& views, int view, Timestamp mean);
  std::uint32_t expected_views(const v1::Snapshot& snapshot) const;

  std::vector<CameraId> camera_ids_;
  std::uint32_t camera_count_;
  bool all_cameras_;                           // the settings have all cameras of the take
  std::vector<std::deque<BlobFrame>> frames_;  // by camera, waiting for their set
  std::deque<RecordedSnapshot> snapshots_;     // waiting for their images
};

}  // namespace mocap::retrack
