#pragma once

#include <memory>
#include <vector>

#include "base/time.h"
#include "model/skeleton.h"
#include "module/labeller.h"

namespace mocap::label {

struct LabelSettings {
  Duration still_for = std::chrono::milliseconds(400);     ///< how long a T-pose is held before it is named
  double still_radius_m = 0.02;                            ///< what moves less holds still
  Duration search_every = std::chrono::milliseconds(100);  ///< for a T-pose, which costs some milliseconds
  std::size_t search_work = 1200;                          ///< for any pose, each set: bone fits of under 1 us
  int limb_work = 40;        ///< for limbs whose names were lost, each set and subject: readings, of a pose or two each
  double most_rms_m = 0.02;  ///< a T-pose's markers from the body that is fitted to them
  double least_share = 0.85;         ///< of the markers that a T-pose must show
  double rigid_tolerance_m = 0.006;  ///< a rigid body's markers from their places
  double tie_slack_m = 0.02;         ///< skin: by how much a distance on the body may change, beside 5 % of it
  double most_gate_m = 0.25;         ///< a lost marker is not looked for further than this from its place
  /// With less than a quarter of the markers, or with a quarter missing while as many nameless tracks stand near.
  Duration lost_after = std::chrono::milliseconds(500);
};

/// Names by T-pose at first, by its measures in any pose where these are known (a rigid body: always), then by keeping
/// them.
///
/// A name stays with its track while that lives and the distances along the body agree. A name that is free goes to
/// an unnamed track near where the body is expected to have it, if the distances to its neighbours agree and no other
/// reading is about as good; else it waits. No track bears two names.
///
/// Allocates here only. One thread owns it.
std::unique_ptr<Labeller> make_labeller(const LabelSettings& settings, std::vector<Subject> subjects);

}  // namespace mocap::label
