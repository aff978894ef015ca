#include "calibrate/rig_import.h"

#include <utility>

#include "settings/rig/rig_file.h"
#include "settings/toml/text_file.h"

namespace mocap::calibrate {

using calibration::ParsedRig;
using calibration::RigFormat;

Result<ParsedRig, settings::Faults> read_rig(const std::filesystem::path& path, std::optional<RigFormat> format) {
  const auto text = settings::read_text(path);
  if (!text) return settings::Faults{path, {text.error()}};
  if (!format) format = calibration::guess_format(*text);
  if (!format) {
    return settings::Faults{path,
                            {{path, 0, 0, "is in an unknown format; set --format to opencv, kalibr, pose2sim or qca"}}};
  }
  if (*format == RigFormat::Pose2Sim) {
    auto read = settings::load_foreign_rig(path);
    if (!read) return read.error();
    return ParsedRig{std::move(read->rig), std::move(read->left_out)};
  }
  auto parsed = calibration::parse_rig(*format, *text, path.stem().string());
  if (parsed) return *std::move(parsed);
  settings::Faults faults{path, {}};
  for (const calibration::FormatFault& fault : parsed.error())
    faults.list.push_back({path, fault.line, fault.column, fault.message});
  return faults;
}

}  // namespace mocap::calibrate
