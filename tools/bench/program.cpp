#include "bench/program.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <filesystem>

namespace mocap::bench {

std::string program_beside(const std::string& name) {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / name).string();
}

Program::Program(const std::string& name, const std::vector<std::string>& arguments) {
  std::string path = program_beside(name);
  std::vector<std::string> all{path};
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> raw;
  for (std::string& each : all) raw.push_back(each.data());
  raw.push_back(nullptr);
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  posix_spawn_file_actions_addopen(&quiet, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  if (posix_spawn(&process_, path.c_str(), &quiet, nullptr, raw.data(), environ) != 0) process_ = 0;
  posix_spawn_file_actions_destroy(&quiet);
}

Program::~Program() {
  if (!runs()) return;
  kill(process_, SIGTERM);
  waitpid(process_, nullptr, 0);
}

bool Program::runs() {
  if (process_ > 0 && waitpid(process_, nullptr, WNOHANG) != 0) process_ = 0;
  return process_ > 0;
}

double Program::cpu_s() {
  clockid_t clock{};
  timespec used{};
  if (!runs() || clock_getcpuclockid(process_, &clock) != 0 || clock_gettime(clock, &used) != 0) return 0.0;
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

}  // namespace mocap::bench
