#include "label/label_settings.h"

namespace mocap::label {

void declare_keys(KeyVisitor& keys, LabelSettings& label) {
  keys.time("still_for_ms", label.still_for, {0, 10000}, {.help = "how long a T-pose is held before it is labelled"});
  keys.millimetres("still_radius_mm", label.still_radius_m, {0.1, 1000},
                   {.help = "a track that moves less is stationary"});
  keys.time("search_every_ms", label.search_every, {1, 10000},
            {.help = "time between two searches for a T-pose, which take some milliseconds each"});
  keys.millimetres("most_rms_mm", label.most_rms_m, {0.1, 1000},
                   {.help = "largest rms distance of the markers of a T-pose from the body fitted to them"});
  keys.flag(
      "search_uncalibrated", label.search_uncalibrated,
      {.help = "find a person without a fitted body in any pose too, from the marker set, while no other person is "
               "missing; markers must be within about 1 cm of their places. A T-pose fits the body more exactly"});
  keys.number("least_share", label.least_share, {0.1, 1},
              {.help = "smallest fraction of its markers that a T-pose shows"});
  keys.millimetres("rigid_tolerance_mm", label.rigid_tolerance_m, {0.1, 1000},
                   {.help = "largest distance of a rigid body's markers from their places"});
  keys.millimetres("distance_tolerance_mm", label.distance_tolerance_m, {0, 1000},
                   {.help = "change of an inter-marker distance that skin allows, beside 5 % of the distance",
                    .formerly = "tie_slack_mm"});
  keys.millimetres("most_gate_mm", label.most_gate_m, {1, 5000},
                   {.help = "largest distance from its prediction at which a lost marker is looked for"});
  keys.time(
      "lost_after_ms", label.lost_after, {1, 60000},
      {.help = "a subject is lost after this time with less than a quarter of its markers, or with a quarter missing "
               "while as many unlabelled tracks are near; after 150 ms, at least two intervals between sets, with "
               "fewer than three measured markers"});
}

}  // namespace mocap::label
