#pragma once

#include <filesystem>

#include "calibration/wand/wand_recording.h"
#include "model/camera_model.h"
#include "take/recordings/blob_recording.h"

namespace mocap::calibrate::testing {

/// Writes a wand recording as a blob recording of the same cameras. Replaces an existing file.
inline void write_recording(const std::filesystem::path& path, const calibration::Take& take, const Rig& rig) {
  std::vector<take::RecordedCamera> cameras;
  for (const CameraModel& camera : rig) cameras.push_back({camera.name, camera.width_px, camera.height_px});
  std::filesystem::remove(path);
  auto writer = take::make_blob_writer(path, cameras);
  MOCAP_EXPECTS(writer.has_value());
  BlobFrame frame;
  for (std::uint32_t c = 0; c < take.cameras.size(); ++c) {
    for (std::size_t i = 0; i < take.cameras[c].size(); ++i) {
      const calibration::Picture& image = take.cameras[c][i];
      frame.camera = CameraId{c};
      frame.number = i;
      frame.exposed_at = image.exposed_at;
      frame.blobs.clear();
      for (const calibration::Spot& point : image.spots) {
        Blob blob;
        blob.centroid = point.at;
        blob.sigma_px = point.sigma_px;
        if (!frame.blobs.try_push_back(blob)) break;
      }
      MOCAP_EXPECTS((*writer)->write(frame).has_value());
    }
  }
  MOCAP_EXPECTS((*writer)->finish().has_value());
}

}  // namespace mocap::calibrate::testing
