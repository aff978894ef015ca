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

/// Writes the content of a marker set file into a new file NAME.toml of the folder, NAME-2.toml if that exists, and so
/// on. Makes the folder. Returns the absolute path. `name` is a file name (base/file_name.h). Fails with Io.
Result<std::filesystem::path> write_marker_set_text(const std::filesystem::path& folder, const std::string& name,
                                                    const std::string& text);

}  // namespace mocap::settings
