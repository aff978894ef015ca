#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "model/ids.h"
#include "module/writer.h"
#include "settings/subject_file.h"

namespace mocap::settings {

/// Whose fits are kept, and where.
struct KeptSubject {
  SubjectId subject;
  std::filesystem::path path;
  SubjectFile known;  ///< name and marker set; the offsets are those of the last fit
};

/// Writes a subject's file anew with each fit that is made of it while the daemon runs; takes no snapshots. Its date is
/// the machine's. A file that cannot be written is an error of that call alone.
std::unique_ptr<Writer> make_subject_keeper(std::vector<KeptSubject> kept);

}  // namespace mocap::settings
