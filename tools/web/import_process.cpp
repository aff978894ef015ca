#include "web/import_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

#include "base/expects.h"
#include "base/file_name.h"
#include "base/time.h"
#include "web/work_folder.h"

namespace mocap::web {
namespace {

namespace fs = std::filesystem;

constexpr Duration kWaitPeriod = std::chrono::milliseconds(20);
constexpr std::size_t kMaxText_bytes = 1024 * 1024;  // of a file that the command writes
constexpr std::size_t kMaxWarnings = 100;

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text(kMaxText_bytes, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

// Starts the command; its output goes into files of the folder.
Result<pid_t> start_import(const std::vector<std::string>& command, const fs::path& folder) {
  const std::string report = folder / "report", words = folder / "words";
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, report.c_str(), O_WRONLY | O_CREAT, 0600);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, words.c_str(), O_WRONLY | O_CREAT, 0600);
  ::posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);  // the server's connections, too
  std::vector<char*> arguments;
  for (const std::string& each : command)
    arguments.push_back(const_cast<char*>(each.c_str()));  // NOLINT: execve's type
  arguments.push_back(nullptr);
  pid_t id = -1;
  const int failed = ::posix_spawn(&id, arguments[0], &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed == 0) return id;
  return Error{ErrorCode::Io, fmt::format("{} cannot be started: {}", command[0], std::strerror(failed))};
}

// Returns the status of the process as waitpid() has it; kills the process after `patience`, and once `stopped` is
// true.
int wait_for(pid_t id, Duration patience, const std::atomic<bool>& stopped) {
  const Timestamp begun = host_now();
  int status = 0;
  while (::waitpid(id, &status, WNOHANG) == 0) {
    if (stopped || host_now() - begun > patience) ::kill(id, SIGKILL);
    std::this_thread::sleep_for(kWaitPeriod);
  }
  return status;
}

// The sentences without the name of the program and without the folder that nobody knows.
std::vector<std::string> sentences_in(const std::string& words, const fs::path& folder) {
  constexpr std::string_view kProgram = "mocapctl: ";
  std::vector<std::string> sentences;
  std::istringstream lines(words);
  const std::string hidden = folder.string() + '/';
  for (std::string line; std::getline(lines, line) && sentences.size() < kMaxWarnings;) {
    if (line.starts_with(kProgram)) line.erase(0, kProgram.size());
    for (std::size_t at; (at = line.find(hidden)) != std::string::npos;) line.erase(at, hidden.size());
    if (!line.empty()) sentences.push_back(std::move(line));
  }
  return sentences;
}

// The import uses the shipped skeleton human18, because a marker set reaches the daemon without its skeleton. Its path
// from the folder for temporary files is of no use to the daemon.
std::string with_shipped_skeleton(std::string text) {
  constexpr std::string_view kKey = "skeleton = ";
  const std::size_t at = text.starts_with(kKey) ? 0 : text.find("\n" + std::string(kKey)) + 1;
  if (at == 0 && !text.starts_with(kKey)) return text;
  text.replace(at, text.find('\n', at) - at, "skeleton = \"../skeletons/human18.toml\"  # of the shipped ones");
  return text;
}

Error failure_of(int status, const std::vector<std::string>& sentences, Duration patience) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) {
    return {ErrorCode::Io, fmt::format("the import was ended after {:.0f} s, or for lack of memory; use a shorter file",
                                       to_s(patience))};
  }
  if (WIFSIGNALED(status)) return {ErrorCode::Io, fmt::format("the import ended by signal {}", WTERMSIG(status))};
  std::string all;
  for (const std::string& sentence : sentences) all += (all.empty() ? "" : "\n") + sentence;
  return {ErrorCode::InvalidArgument, all.empty() ? "the import failed without a reason" : all};
}

}  // namespace

Result<ImportedSubject> run_import(const fs::path& mocapctl, const ImportWish& wish, Duration patience,
                                   const std::atomic<bool>& stopped) {
  MOCAP_EXPECTS(is_file_name(wish.name));
  const WorkFolder folder;
  const fs::path upload = folder.path() / "upload.c3d", out = folder.path() / "out";
  std::ofstream file(upload, std::ios::binary);
  file << wish.c3d;
  file.close();
  if (!folder.made() || !file)
    return Error{ErrorCode::Io, "the file cannot be written into the folder for temporary files"};
  std::vector<std::string> command{mocapctl.string(),
                                   "subject",
                                   "import",
                                   upload.string(),
                                   "--name=" + wish.name,
                                   "--out=" + out.string(),
                                   "--json",
                                   "--skeleton=skeletons/human18.toml"};
  if (wish.at_rest) command.emplace_back("--static");
  const Result<pid_t> process = start_import(command, folder.path());
  if (!process) return process.error();
  const int status = wait_for(*process, patience, stopped);
  ImportedSubject imported;
  imported.warnings = sentences_in(read_text(folder.path() / "words"), folder.path());
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return failure_of(status, imported.warnings, patience);
  imported.report_json = read_text(folder.path() / "report");
  imported.marker_set = with_shipped_skeleton(read_text(out / (wish.name + ".markers.toml")));
  return imported;
}

}  // namespace mocap::web
