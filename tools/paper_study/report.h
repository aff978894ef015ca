#pragma once

#include <string>
#include <vector>

#include "paper_study/cost.h"
#include "paper_study/multiview.h"
#include "paper_study/quality.h"

namespace mocap::paper_study {

/// All results of one run. Parts that were not run are empty.
struct Report {
  QualitySettings settings;
  std::vector<SituationQuality> one_camera;
  std::vector<MultiviewQuality> multiview;
  std::vector<MethodCost> costs;
};

/// One JSON object in one line with losses, error_px, multiview_losses and cost_ms, each by situation or method.
std::string to_json(const Report& report);

/// Text with losses and errors of every method in every situation, and costs for 30 and 1000 markers.
std::string to_text(const Report& report);

/// Tables I to VII of the study with the published, rebuilt and our values, and remarks on the differences.
std::string to_markdown(const Report& report);

}  // namespace mocap::paper_study
