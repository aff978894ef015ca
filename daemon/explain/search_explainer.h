#pragma once

#include <memory>
#include <vector>

#include "explain/pose_attempt.h"
#include "model/camera_model.h"
#include "model/skeleton.h"
#include "module/search_explainer.h"

namespace mocap::explain {

/// Makes the explainer of the searches for `subjects`. `known`: other marker sets that a subject may wear by mistake.
std::unique_ptr<SearchExplainer> make_search_explainer(const ExplainSettings& settings, Rig rig,
                                                       std::vector<Subject> subjects,
                                                       const std::vector<MarkerSet>& known);

}  // namespace mocap::explain
