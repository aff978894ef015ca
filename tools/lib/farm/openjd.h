#pragma once

#include <filesystem>

#include "base/result.h"
#include "lib/farm/submission.h"

namespace mocap::farm {

/// A job template of Open Job Description, version 2023-09, without extensions: one task is one unit. Each step has at
/// most 1024 tasks, the limit of the specification. Fails with InvalidArgument if a path or an option cannot be in a
/// template: over 1024 characters, control characters, "{{".
///
/// Source: https://github.com/OpenJobDescription/openjd-specifications, wiki/2023-09-Template-Schemas.md.
Result<nlohmann::ordered_json> openjd_template(const FarmOrder& order);

/// Writes the template as `template.json` into the folder of the farm, which is then a job bundle. Returns its path.
/// Fails as openjd_template, and with Io.
Result<std::filesystem::path> write_openjd(const FarmOrder& order);

}  // namespace mocap::farm
