#include "web/work_folder.h"

#include <cstdlib>
#include <system_error>

namespace mocap::web {

WorkFolder::WorkFolder() {
  std::error_code error;
  path_ = (std::filesystem::temp_directory_path(error) / "mocap-web-XXXXXX").string();
  made_ = ::mkdtemp(path_.data()) != nullptr;
}

WorkFolder::~WorkFolder() {
  std::error_code error;
  if (made_) std::filesystem::remove_all(path_, error);
}

}  // namespace mocap::web
