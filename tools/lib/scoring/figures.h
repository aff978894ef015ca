#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "lib/scoring/clear_mot.h"
#include "lib/scoring/labels_score.h"
#include "lib/scoring/skeleton_score.h"

namespace mocap::scoring {

/// A number, or null where it is absent or infinite.
nlohmann::ordered_json or_null(const std::optional<double>& figure);

/// The figures under the names that stand in all reports.
void put(nlohmann::ordered_json& into, const LabelCounts& labels);
void put(nlohmann::ordered_json& into, const SkeletonCounts& bones);
void put(nlohmann::ordered_json& into, const ClearMot::Counts& mot);

/// "12.34", or "-" where there is none.
std::string cell(const std::optional<double>& figure, int digits);

/// The mean time to a first name; nothing where a subject never had one.
std::optional<double> first_label_s(const LabelCounts& labels);

}  // namespace mocap::scoring
