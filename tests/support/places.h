#pragma once

#include <string>

namespace mocap::support {

/// Absolute paths. places.cpp alone contains them, so that a compiler cache can reuse all other object files for
/// another working copy.
std::string source_folder();       ///< root of the source tree
std::string shared_data_folder();  ///< recordings next to the source tree; tests are skipped if it does not exist
std::string program_folder();      ///< programs of this build

}  // namespace mocap::support
