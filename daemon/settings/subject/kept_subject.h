#pragma once

#include <filesystem>

#include "model/ids.h"
#include "settings/subject/subject_file.h"

namespace mocap::settings {

/// A subject whose fits are kept in a file.
struct KeptSubject {
  SubjectId subject;
  std::filesystem::path path;
  SubjectFile known;  ///< name and marker set; the offsets are those of the last fit
};

}  // namespace mocap::settings
