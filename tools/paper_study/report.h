#pragma once

#include <string>
#include <vector>

#include "paper_study/cost.h"
#include "paper_study/multiview.h"
#include "paper_study/quality.h"

namespace mocap::paper_study {

/// All that one run found; what was left out is empty.
struct Report {
  QualitySettings settings;
  std::vector<SituationQuality> one_camera;
  std::vector<MultiviewQuality> multiview;
  std::vector<MethodCost> costs;
};

/// One JSON object in one line: losses, error_px, multiview_losses, cost_ms, each by situation or method.
std::string to_json(const Report& report);

/// For people: losses and errors of every method in every situation, costs of 30 markers.
std::string to_text(const Report& report);

/// Tables I to VII of the study, each with the published value, our rebuild and ours, and a sentence on the difference.
std::string to_markdown(const Report& report);

}  // namespace mocap::paper_study
