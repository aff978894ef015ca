#pragma once

#include <cstddef>
#include <filesystem>

#include "ctl/take/export_formats.h"
#include "export/clip/clip.h"
#include "export/clip/clip_builder.h"
#include "export/write_options.h"
#include "take/recordings/snapshot_reader.h"

namespace mocap::ctl {

/// A file that `mocapctl take export` wrote, and what it lacks of the take.
struct ExportReport {
  std::filesystem::path file;
  const ExportFormat* format = nullptr;  ///< of the table: never null in a report that is printed
  exports::WriteOptions options;
  exports::ClipReport recorded;
  take::RecordingFaults faults;
  std::size_t marks_left_out = 0;  ///< that the format does not hold
};

/// Prints a report, and of the clip that was written its frames, subjects and marks, to standard output.
void print_export_json(const ExportReport& report, const exports::Clip& clip);
void print_export_text(const ExportReport& report, const exports::Clip& clip);

}  // namespace mocap::ctl
