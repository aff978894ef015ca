#pragma once

#include <string>

namespace mocap {

/// A file that a take carries: the configuration, the rig, a marker set, a subject.
struct TakeFile {
  std::string name;
  std::string media_type = "application/toml";
  std::string bytes;
};

}  // namespace mocap
