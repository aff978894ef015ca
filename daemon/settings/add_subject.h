#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "base/result.h"
#include "settings/faults.h"

namespace mocap::settings {

/// Names and paths without quotes and control characters.
struct NewSubject {
  std::string name;
  std::filesystem::path marker_set;  ///< absolute
};

/// Appends a [[subject]] to a configuration that somebody wrote by hand, and changes nothing else in it. What it would
/// be is given to `faults_of` first, as a file beside it. Fails with InvalidArgument and these faults, and with Io;
/// then the configuration is as it was.
Status add_subject(const std::filesystem::path& configuration, const NewSubject& subject,
                   const std::function<Faults(const std::filesystem::path&)>& faults_of);

}  // namespace mocap::settings
