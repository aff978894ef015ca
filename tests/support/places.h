#pragma once

#include <string>

namespace mocap::support {

/// Folders that depend on where the project lies. Told by one small file, so that a compiler's cache knows all others
/// wherever it lies.
std::string source_folder();       ///< the project
std::string shared_data_folder();  ///< recordings beside it, which need not be there: tests skip without them
std::string program_folder();      ///< the programs of this build

}  // namespace mocap::support
