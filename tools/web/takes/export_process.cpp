#include "web/takes/export_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "web/work_folder.h"

namespace mocap::web {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxWords_bytes = 4096;  // of what the command says
constexpr int kLook_ms = 200;

struct Process {
  pid_t id = -1;
  int words = -1;  // what the process says on standard error
};

Result<Process> start(const std::vector<std::string>& command) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) return Error{ErrorCode::Io, std::string("pipe: ") + std::strerror(errno)};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, pipe[1], STDERR_FILENO);
  ::posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);  // the server's connections, too
  std::vector<char*> arguments;
  for (const std::string& each : command)
    arguments.push_back(const_cast<char*>(each.c_str()));  // NOLINT: execve's type
  arguments.push_back(nullptr);
  Process process{.id = -1, .words = pipe[0]};
  const int failed = ::posix_spawn(&process.id, arguments[0], &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(pipe[1]);
  if (failed == 0) return process;
  ::close(pipe[0]);
  return Error{ErrorCode::Io, fmt::format("{} cannot be started: {}", command[0], std::strerror(failed))};
}

// Takes whole lines out of `words`: progress, and the rest, which is returned.
std::string other_lines(std::string& words, std::atomic<double>& progress) {
  std::string others;
  for (std::size_t end; (end = words.find('\n')) != std::string::npos; words.erase(0, end + 1)) {
    const std::string line = words.substr(0, end);
    if (!read_progress(line, progress)) others += line + ' ';
  }
  return others;
}

// Reads until the process closes its standard error; returns what it said.
std::string listen(const Process& process, std::atomic<double>& progress, const std::atomic<bool>& stopped) {
  std::string words, said;
  std::array<char, 1024> bytes{};
  while (true) {
    if (stopped) ::kill(process.id, SIGKILL);
    pollfd ready{process.words, POLLIN, 0};
    if (::poll(&ready, 1, kLook_ms) <= 0) continue;
    const ssize_t count = ::read(process.words, bytes.data(), bytes.size());
    if (count <= 0) break;
    words.append(bytes.data(), static_cast<std::size_t>(count));
    said = (said + other_lines(words, progress)).substr(0, kMaxWords_bytes);
    if (words.size() > kMaxWords_bytes) words.clear();  // no line of ours
  }
  return said + words;
}

// "mocapctl: no such subject \n" without the name of the program.
std::string sentence_in(std::string said) {
  constexpr std::string_view kProgram = "mocapctl: ";
  if (said.starts_with(kProgram)) said.erase(0, kProgram.size());
  while (!said.empty() && (said.back() == ' ' || said.back() == '\n')) said.pop_back();
  return said;
}

}  // namespace

bool read_progress(const std::string& line, std::atomic<double>& progress) {
  double share = 0.0;
  if (std::sscanf(line.c_str(), "progress %lf", &share) != 1) return false;
  progress = std::clamp(share, 0.0, 1.0);
  return true;
}

fs::path mocapctl_here() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path() / "mocapctl";
}

Result<std::shared_ptr<OpenFile>> run_export(const fs::path& mocapctl, const ExportWish& wish,
                                             std::atomic<double>& progress, const std::atomic<bool>& stopped) {
  const WorkFolder folder;
  if (!folder.made()) {
    return Error{ErrorCode::Io, fmt::format("a folder for the export cannot be made: {}", std::strerror(errno))};
  }
  const fs::path out = folder.path() / "export";
  std::vector<std::string> command{mocapctl.string(),         "take",      "export",
                                   wish.take.string(),        "--out",     out.string(),
                                   "--format=" + wish.format, "--progress"};
  command.insert(command.end(), wish.options.begin(), wish.options.end());
  const Result<Process> process = start(command);
  if (!process) return process.error();
  const std::string said = sentence_in(listen(*process, progress, stopped));
  ::close(process->words);
  int status = 0;
  ::waitpid(process->id, &status, 0);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return OpenFile::open(out);
  if (WIFSIGNALED(status) && said.empty())
    return Error{ErrorCode::Io, fmt::format("the export ended by signal {}: too little memory?", WTERMSIG(status))};
  return Error{ErrorCode::InvalidArgument, said};
}

}  // namespace mocap::web
