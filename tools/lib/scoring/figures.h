#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "lib/scoring/clear_mot.h"
#include "lib/scoring/labels_score.h"
#include "lib/scoring/skeleton_score.h"

namespace mocap::scoring {

/// The figure as a JSON number, or null if the figure is absent or infinite.
nlohmann::ordered_json or_null(const std::optional<double>& figure);

/// Adds the figures to a JSON object, with the same keys in all reports.
void put(nlohmann::ordered_json& into, const LabelCounts& labels);
void put(nlohmann::ordered_json& into, const SkeletonCounts& bones);
void put(nlohmann::ordered_json& into, const ClearMot::Counts& mot);

/// The figure as text with `digits` decimals, or "-" if the figure is absent.
std::string cell(const std::optional<double>& figure, int digits);

/// The mean time to the first label over the subjects. Empty if a subject was never labelled.
std::optional<double> first_label_s(const LabelCounts& labels);

}  // namespace mocap::scoring
