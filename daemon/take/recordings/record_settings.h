#pragma once

#include <filesystem>
#include <vector>

#include "base/key_visitor.h"

namespace mocap::take {

/// [record]: recordings of a run. Help: the table in record_settings.cpp.
struct RecordSettings {
  std::filesystem::path snapshots;  ///< empty: not recorded
  std::filesystem::path blobs;      ///< empty: not recorded
};

void declare_keys(KeyVisitor& keys, RecordSettings& record);

/// Returns the faults of the file names.
std::vector<KeyFault> faults_of(const RecordSettings& record);

}  // namespace mocap::take
