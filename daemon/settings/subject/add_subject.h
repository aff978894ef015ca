#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "base/result.h"
#include "settings/faults.h"

namespace mocap::settings {

/// A subject to add. Name and path have no quotes and no control characters.
struct NewSubject {
  std::string name;
  std::filesystem::path marker_set;  ///< absolute
};

/// Appends a [[subject]] to a configuration file and changes no other byte. The new text is first written to a file
/// beside it and passed to `faults_of`. Fails with InvalidArgument and these faults, or with Io; the configuration is
/// then unchanged.
Status add_subject(const std::filesystem::path& configuration, const NewSubject& subject,
                   const std::function<Faults(const std::filesystem::path&)>& faults_of);

/// The same for the file of added subjects in the state folder, which is made if it does not exist.
Status add_subject_to_state(const std::filesystem::path& added_subjects, const NewSubject& subject,
                            const std::function<Faults(const std::filesystem::path&)>& faults_of);

}  // namespace mocap::settings
