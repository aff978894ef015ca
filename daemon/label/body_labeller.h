#pragma once

#include <memory>
#include <vector>

#include "label/label_settings.h"
#include "model/skeleton.h"
#include "module/labeller.h"

namespace mocap::label {

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
