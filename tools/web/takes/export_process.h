#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "web/takes/file_stream.h"

namespace mocap::web {

/// A take in a format of `mocapctl take export`.
struct ExportWish {
  std::filesystem::path take;
  std::string format;
  std::vector<std::string> options;  ///< of the command, such as "--unit=m"
};

/// Runs `mocapctl take export` as a process of its own, so that the memory and the faults of an export stay out of this
/// program. Returns the exported file, which has no name any more. `progress`: the share that was read, 0 to 1. Ends
/// the process and fails once `stopped` is true. Fails with the sentence of the command.
Result<std::shared_ptr<OpenFile>> run_export(const std::filesystem::path& mocapctl, const ExportWish& wish,
                                             std::atomic<double>& progress, const std::atomic<bool>& stopped);

/// The program `mocapctl` of this installation: beside this program.
std::filesystem::path mocapctl_here();

/// Takes the share from a line "progress 0.25"; leaves other lines.
bool read_progress(const std::string& line, std::atomic<double>& progress);

}  // namespace mocap::web
