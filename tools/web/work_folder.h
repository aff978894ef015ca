#pragma once

#include <filesystem>
#include <string>

namespace mocap::web {

/// A new folder in the folder for temporary files, removed with its content.
class WorkFolder {
 public:
  WorkFolder();
  ~WorkFolder();
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;

  bool made() const { return made_; }
  std::filesystem::path path() const { return path_; }

 private:
  std::string path_;
  bool made_ = false;
};

}  // namespace mocap::web
