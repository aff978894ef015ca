#include "track3d/track_markers_settings.h"

namespace mocap::track3d {

void declare_keys(KeyVisitor& keys, TrackMarkersSettings& track) {
  keys.number("gate_sigmas", track.gate_sigmas, {1, 10},
              {.help = "radius of the gate in standard deviations of the innovation"});
  keys.millimetres("gate_floor_mm", track.gate_floor_m, {0, 100},
                   {.help = "standard deviation by which the gate is wider, beside that of gate_per_speed; the "
                            "estimate stays as it is"});
  keys.number("gate_per_speed", track.gate_per_speed, {0, 2},
              {.help = "m of standard deviation of the gate for each m of predicted motion between two sets"});
  keys.number("confirm_sets", track.confirm_sets, {1, 100}, {.help = "consecutive sets until a track is confirmed"});
  keys.time("max_coast_ms", track.max_coast, {0, 10000}, {.help = "a track ends when it is not seen for longer"});
  keys.millimetres("max_coast_sigma_mm", track.max_coast_sigma_m, {1, 10000},
                   {.help = "a track that is not seen ends at a larger standard deviation"});
  keys.number("acceleration_m_s2", track.acceleration_m_s2, {0.01, 1000},
              {.help = "process noise: standard deviation of the acceleration"});
  keys.number("acceleration_per_speed_1_s", track.acceleration_per_speed_1_s, {0, 100},
              {.help = "added to it for each m/s of speed"});
  keys.number("max_noise_scale", track.max_noise_scale, {1, 1000},
              {.help = "largest factor by which surprising measurements raise the variance of the process noise",
               .formerly = "max_agility"});
  keys.number("initial_speed_m_s", track.initial_speed_m_s, {0.01, 100},
              {.help = "standard deviation of the velocity of a new track", .formerly = "birth_speed_m_s"});
  keys.time("coast_half_life_ms", track.coast_half_life, {0, 10000},
            {.help = "the predicted speed of a track that is not seen halves in this time; 0: constant speed"});
  keys.millimetres("sighting_floor_mm", track.sighting_floor_m, {0, 100},
                   {.help = "smallest standard deviation of a measurement: the marker's own shape"});
}

}  // namespace mocap::track3d
