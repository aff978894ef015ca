#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace mocap::web {

/// A C3D file for `mocapctl subject import`.
struct ImportWish {
  std::string name;      ///< of the subject; a file name (base/file_name.h)
  bool at_rest = false;  ///< a person stands in T-pose or A-pose
  std::string c3d;       ///< the bytes of the file
};

struct ImportedSubject {
  std::string report_json;            ///< what the command prints with --json
  std::vector<std::string> warnings;  ///< sentences of the command
  std::string marker_set;             ///< content of the marker set file; its skeleton is a shipped one
};

/// Runs `mocapctl subject import` as a process of its own, so that the memory and the faults of reading a file from
/// outside stay out of this program (decisions/0003). Fails with InvalidArgument and the sentence of the command, and
/// with Io if the command cannot run, takes longer than `patience`, or was ended because `stopped` became true.
Result<ImportedSubject> run_import(const std::filesystem::path& mocapctl, const ImportWish& wish,
                                   std::chrono::nanoseconds patience, const std::atomic<bool>& stopped);

}  // namespace mocap::web
