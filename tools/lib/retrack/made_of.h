#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/retrack/retrack.h"
#include "model/take/take_file.h"

namespace mocap::retrack {

/// SHA-256, in hexadecimal digits, of all that decides the messages of a new take: the bytes of the recorded take, the
/// files of the settings in force, the options of the order, and `producer`, the version of the program. Two new takes
/// with the same digest have the same messages; chunks of one take have the same digest. Fails with NotFound and Io
/// (the take).
Result<std::string> made_of(const RetrackOrder& order, const std::vector<TakeFile>& settings_files,
                            const std::string& producer);

/// Passes if a take is whole (every checksum and message is right) and was made of this. Fails with InvalidArgument
/// otherwise, and as take::verify_take.
Status check_made_of(const std::filesystem::path& take, const std::string& digest);

}  // namespace mocap::retrack
