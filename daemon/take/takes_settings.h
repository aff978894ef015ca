#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "base/time.h"

namespace mocap::take {

/// [takes]: recording on an operator's order. Help: the table in takes_settings.cpp.
struct TakesSettings {
  std::filesystem::path folder = "takes";
  std::string name = "{slate}_{number}";
  std::uint64_t min_free_mb = 500;
  bool blobs = true;
  bool snapshots = true;
  Duration before = std::chrono::seconds(30);
  std::uint64_t memory_mb = 128;
  std::filesystem::path shots;  ///< no key: file of the shot list; empty: it is not kept

  friend bool operator==(const TakesSettings&, const TakesSettings&) = default;
};

void declare_keys(KeyVisitor& keys, TakesSettings& takes);

/// Returns the faults of the name pattern.
std::vector<KeyFault> faults_of(const TakesSettings& takes);

}  // namespace mocap::take
