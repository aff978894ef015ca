#include "support/places.h"

namespace mocap::support {

std::string source_folder() { return MOCAP_SOURCE_DIR; }
std::string shared_data_folder() { return MOCAP_SOURCE_DIR "/../shared/data"; }
std::string program_folder() { return MOCAP_BIN_DIR; }

}  // namespace mocap::support
