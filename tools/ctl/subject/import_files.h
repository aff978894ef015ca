#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "model/skeleton.h"
#include "settings/subject/subject_file.h"

namespace mocap::ctl {

/// The files of an imported subject.
struct ImportFiles {
  std::filesystem::path skeleton, marker_set, subject;  ///< skeleton: empty if it is not written
};

/// NAME.skeleton.toml (with a skeleton of its own), NAME.markers.toml and NAME.subject.toml in `folder`.
ImportFiles import_files(const std::filesystem::path& folder, const std::string& name, bool own_skeleton);

/// Fails with InvalidArgument if one of the files exists.
Status check_absent(const ImportFiles& files);

/// Writes the files, and the folder if it is missing. All files are written beside their final names first, so that
/// after a failure the files are those before, or absent. `skeleton`: the file that the marker set names. `replace`:
/// the files may exist. Fails with Io.
Status save_import(const ImportFiles& files, const MarkerSet& set, const std::filesystem::path& skeleton,
                   const settings::SubjectFile& subject, bool replace);

}  // namespace mocap::ctl
