#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "export/clip/clip.h"
#include "export/sink.h"
#include "export/write_options.h"

namespace mocap::ctl {

/// A file format of `mocapctl take export`.
struct ExportFormat {
  std::string_view name;       ///< of --format
  std::string_view extension;  ///< of its files, without the dot
  std::string_view about;
  std::vector<exports::Axes> axes;   ///< what --axes may be; the first is the default
  std::vector<exports::Unit> units;  ///< what --unit may be; the first is the default
  std::size_t most_subjects;         ///< in one file
  std::size_t most_marks;            ///< of the operator, in one file
  Status (*write)(const exports::Clip& clip, const exports::WriteOptions& options, const exports::Sink& sink);
};

/// All formats. A new format is one line of the table.
std::span<const ExportFormat> export_formats();

/// The format with this name or extension; null if there is none.
const ExportFormat* format_named(std::string_view name);

}  // namespace mocap::ctl
