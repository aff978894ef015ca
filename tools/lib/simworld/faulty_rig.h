#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "calibration/wand/wand_recording.h"
#include "lib/simworld/scene_file.h"
#include "model/camera_model.h"

namespace mocap::simworld {

/// A fault between a rig file and the cameras.
enum class PlantedFault {
  None,
  Exchanged,   ///< two cameras deliver each other's images
  Turned,      ///< by 3 degrees about a random axis
  UpsideDown,  ///< by 180 degrees about the optical axis
  OtherLens,   ///< focal length 0.6 to 0.8 or 1.25 to 1.6 times that of the rig, other distortion
  OtherRig,    ///< the rig file describes another room
  Mirrored,    ///< left and right of the images are exchanged
  Late,        ///< the images bear the exposure times of the next ones
};

inline constexpr PlantedFault kPlantedFaults[] = {
    PlantedFault::Exchanged, PlantedFault::Turned,   PlantedFault::UpsideDown, PlantedFault::OtherLens,
    PlantedFault::OtherRig,  PlantedFault::Mirrored, PlantedFault::Late};

const char* name_of(PlantedFault fault);

/// The blobs of a scene, and a rig file that does not fit one camera.
struct FaultyRecording {
  Rig rig;  ///< as the file says
  calibration::Take blobs;
  std::size_t camera = 0;  ///< that has the fault
  std::size_t other = 0;   ///< Exchanged: the other camera
};

/// The same arguments give the same recording. `clip`: as make_performers. Fails if a file of the scene cannot be used.
Result<FaultyRecording> record_with_fault(const SceneFile& scene, const std::string& clip, PlantedFault fault,
                                          std::uint64_t seed, double seconds);

}  // namespace mocap::simworld
