#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "take/take_reader.h"

namespace mocap::takes {

/// "complete", "is being recorded", "cut off", "damaged" or "repaired".
const char* state_of(const take::TakeReader& reader);
double seconds_of(const take::TakeReader& reader);

/// The quality of a take: the figures of its metadata, or measured from its snapshots if it has none (it was cut off,
/// is being recorded, or is large), which reads the whole take.
nlohmann::ordered_json quality_of(const take::TakeReader& reader);

/// All that is known of a take. Reads as `quality_of`.
nlohmann::ordered_json json_of(const take::TakeReader& reader);

/// A line of a list of takes: from the metadata alone.
nlohmann::ordered_json summary_of(const take::TakeReader& reader);

/// The .mcap files among the files and in the folders, by name. No places: the current folder.
std::vector<std::filesystem::path> takes_in(std::vector<std::filesystem::path> places);

/// Renames a take and its file. Fails as take::rename_take and take::edit_take; the take then keeps its name.
Result<std::filesystem::path> rename(const std::filesystem::path& file, const std::string& name);

}  // namespace mocap::takes
