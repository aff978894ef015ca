#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/benchmark/labelled_clip.h"
#include "model/transform.h"

namespace mocap::benchmark {

/// Duration of the T-pose at the beginning of a clip.
inline constexpr double kClipTPose_s = 2.0;

/// How a clip with known poses is made of a motion.
struct PosedClipSettings {
  double seconds = 20.0;  ///< after the beginning
  double rate_hz = 120.0;
  double size = 1.0;  ///< of the body, relative to the marker set
  double marker_error_mm =
      0.0;  ///< standard deviation of the true marker offsets from those of the marker set, each axis
  double soft_tissue_mm = 0.0;  ///< rms distance of a marker from its place on the bone
  int occlusion_cameras =
      0;                   ///< a marker is visible where two cameras of a ring of these see it past the body; 0: always
  std::uint64_t seed = 1;  ///< of marker errors and soft tissue
};

/// A motion of which markers and bones are known in each frame, world frame, z up. It begins with 2 s of T-pose and 1 s
/// of transition.
struct PosedClip {
  LabelledClip clip;            ///< with the marker set as it is in the file
  MarkerSet body;               ///< the true bone lengths and marker offsets
  std::vector<Pose> poses;      ///< world_from_bone, frame after frame, one for each bone
  std::size_t begin = 0;        ///< first frame of the motion itself
  double soft_tissue_mm = 0.0;  ///< as PosedClipSettings

  const Pose* bones(std::size_t frame) const { return &poses[frame * body.skeleton.bones.size()]; }
};

/// Standard deviation, each axis, of each of the two displacements by soft tissue: one is common to the markers of a
/// bone, one is of the marker alone.
double soft_tissue_sigma_m(double rms_mm);

/// Moves the body of a marker set by a BVH file, or by a program of acts such as "walk:5,wave".
///
/// Soft tissue: each marker is displaced by a Gaussian process with an exponential covariance of 0.2 s, isotropic; half
/// of its variance is common to the markers of a bone. Its size is that of markers on thigh and shank (Leardini et al.,
/// "Human movement analysis using stereophotogrammetry, part 3", Gait & Posture 2005). Occlusion: scene::Flesh.
///
/// The same arguments give the same clip. Fails with NotFound, or with InvalidArgument and the reason.
Result<PosedClip> make_posed_clip(const std::string& motion, const std::filesystem::path& marker_set_file,
                                  const PosedClipSettings& settings);

}  // namespace mocap::benchmark
