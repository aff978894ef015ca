#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace mocap::bench {

/// The program of this name in the folder of this program; an absolute path stays as it is.
std::string program_beside(const std::string& name);

/// A program of the project that runs beside this one, in the same folder, and ends with this object. Its messages are
/// not shown.
class Program {
 public:
  Program(const std::string& name, const std::vector<std::string>& arguments);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// False: the program could not be started, or ended by itself.
  bool runs();
  /// The processor time of all its threads until now, s; 0 if it does not run.
  double cpu_s();

 private:
  pid_t process_ = 0;  // 0: none
};

}  // namespace mocap::bench
