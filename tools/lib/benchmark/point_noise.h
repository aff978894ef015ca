#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "lib/benchmark/labelled_clip.h"

namespace mocap::benchmark {

/// Noise of a point cloud. All zero: the points of the recording.
///
/// Hidden markers, ghosts, cuts and shuffled points follow the description of SOMA's training and test noise (Ghorbani
/// and Black, "SOMA: Solving Optical Marker-Based MoCap Automatically", ICCV 2021); the probability of a ghost was
/// compared with its public code. The share of each frame follows MoCap-Solver (Chen et al., "MoCap-Solver: A Neural
/// Solver for Optical Motion Capture Data", SIGGRAPH 2021).
struct PointNoise {
  int hidden_min = 0, hidden_max = 0;  ///< markers hidden in each frame, independent of other frames; uniform
  int ghost_channels = 0;  ///< each is present with probability (8/9)^3, at a normal position with the median and the
                           ///< standard deviation of the markers of the frame, each axis
  int cuts = 0;            ///< tracks that end, in random frames, where another track of the same marker begins
  double studio_share = 0.0;   ///< share of the samples that is hidden in rare and long gaps (see studio_gap_frames)
  double uniform_share = 0.0;  ///< share of the samples that is hidden in gaps of 0.5 s
  double frame_sigma = 0.0;  ///< in each frame a share p of the markers is hidden and another p is shifted, where p is
                             ///< min(|N(0, frame_sigma)|, 0.2); a shift is uniform within 0.3 m, each axis, and makes
                             ///< the point a ghost
};

/// Noise by name: none, soma (0 to 4 hidden, ghosts), hidden5 (exactly 5 hidden, ghosts), cuts50 (soma, 50 cuts),
/// studio, uniform10, uniform30, solver (frame_sigma 0.1).
std::optional<PointNoise> noise_named(std::string_view name);
inline constexpr std::string_view kNoiseNames[] = {"none",   "soma",      "hidden5",   "cuts50",
                                                   "studio", "uniform10", "uniform30", "solver"};

struct NoisyPoint {
  static constexpr int kNobodys = -1;

  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  int marker = kNobodys;      ///< true label; kNobodys: a ghost, or a point whose label the marker set lacks
  bool is_duplicate = false;  ///< the true label is unknown (find_duplicates)
};

/// The points of one frame, in random order.
struct NoisyFrame {
  std::vector<NoisyPoint> points;
  std::vector<Eigen::Vector3d> cut_m;  ///< points whose tracks end in the frame before
};

/// The frames of a clip with noise. Pure: the same clip, noise and seed give the same frames on every machine.
std::vector<NoisyFrame> add_noise(const LabelledClip& clip, const PointNoise& noise, std::uint64_t seed);

/// The frames from the last to the first. A track that ends where another one begins does so between the same two
/// frames; if its marker is hidden in the frame that comes later now, at the next point of the marker.
std::vector<NoisyFrame> reversed(const std::vector<NoisyFrame>& frames);

/// Length of a studio gap, frames, at quantile `share` in [0, 1): 6 at 0.5, 115 at 0.9, 420 at 0.99, at most 800;
/// logarithms are interpolated. Source: gaps of studio recordings, p50 6, p90 104 to 125, p99 over 400 frames.
double studio_gap_frames(double share);

}  // namespace mocap::benchmark
