#pragma once

#include <memory>
#include <vector>

#include "module/writer.h"
#include "settings/subject/kept_subject.h"

namespace mocap::settings {

/// Makes a writer that replaces a subject's file at each fit of the subject; it ignores snapshots. The date in the file
/// is that of the host's clock. A file that cannot be written is an error of that call alone.
std::unique_ptr<Writer> make_subject_keeper(std::vector<KeptSubject> kept);

}  // namespace mocap::settings
