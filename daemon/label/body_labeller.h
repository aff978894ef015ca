#pragma once

#include <memory>
#include <vector>

#include "label/label_settings.h"
#include "model/skeleton.h"
#include "module/labeller.h"

namespace mocap::label {

/// Makes the labeller of people and rigid props.
///
/// A person is identified in T-pose or A-pose, or, if the body was fitted before or LabelSettings::search_uncalibrated
/// is set, in any pose; a rigid prop always.
/// From then on the labels follow the predicted pose of the body (`SubjectLabeller`), with one assignment for all
/// subjects (`TrackAssociation`). A label without a clear track waits, and no track has two labels.
///
/// Allocates in this function only. The result is used by one thread and reads no clock.
std::unique_ptr<Labeller> make_labeller(const LabelSettings& settings, std::vector<Subject> subjects);

}  // namespace mocap::label
