#include "track2d/track_blobs_settings.h"

namespace mocap::track2d {

void declare_keys(KeyVisitor& keys, TrackBlobsSettings& track) {
  keys.choice<TrackMethod>("method", track.method,
                           {{"alpha_beta", TrackMethod::AlphaBeta},
                            {"adaptive_alpha_beta", TrackMethod::AdaptiveAlphaBeta},
                            {"kalman", TrackMethod::Kalman},
                            {"condensation", TrackMethod::Condensation}},
                           {.help = "filter of each track"});
  keys.number("gate_sigmas", track.gate_sigmas, {1, 10},
              {.help = "radius of the gate in standard deviations of the innovation"});
  keys.number("gate_floor_px", track.gate_floor_px, {0, 100}, {.help = "standard deviation added to the innovation"});
  keys.number("gate_per_speed", track.gate_per_speed, {0, 2},
              {.help = "standard deviation added for each px of predicted motion between two images"});
  keys.number("gate_growth_px_s", track.gate_growth_px_s, {0, 10000},
              {.help = "growth of the gate while the marker is not seen (kalman)"});
  keys.number("confirm_images", track.confirm_images, {1, 100},
              {.help = "consecutive images until a track is confirmed"});
  keys.time("max_coast_ms", track.max_coast, {0, 10000}, {.help = "a track ends when it is not seen for longer"});
  keys.number("acceleration_px_s2", track.acceleration_px_s2, {1, 1e6},
              {.help = "process noise: standard deviation of the acceleration"});
  keys.number("initial_speed_px_s", track.initial_speed_px_s, {1, 1e5},
              {.help = "standard deviation of the velocity of a new track", .formerly = "birth_speed_px_s"});
  keys.number("alpha", track.alpha, {0, 1}, {.help = "alpha_beta: gain of the position"});
  keys.number("beta", track.beta, {0, 2}, {.help = "alpha_beta: gain of the velocity"});
  keys.number("alpha_beta_gate_px", track.alpha_beta_gate_px, {0.1, 100},
              {.help = "alpha_beta: standard deviation of its fixed gate"});
  keys.number("particles", track.particles, {2, 256}, {.help = "condensation: particles for each track"});
  keys.number("seed", track.seed, {0, 9e15}, {.help = "condensation: seed of the random numbers"});
}

}  // namespace mocap::track2d
