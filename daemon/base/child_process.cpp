#include "base/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <utility>

namespace mocap {
namespace {

constexpr std::size_t kMaxLine_bytes = 64 * 1024;

// Moves the whole lines out of `text`.
std::vector<std::string> take_lines(std::string& text) {
  std::vector<std::string> lines;
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    lines.push_back(text.substr(begin, end - begin));
  }
  text.erase(0, begin);
  if (text.size() >= kMaxLine_bytes) {
    lines.push_back(text);
    text.clear();
  }
  return lines;
}

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& command) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) return Error{ErrorCode::Io, fmt::format("pipe: {}", std::strerror(errno))};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, pipe[1], STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, pipe[1], STDERR_FILENO);
  std::vector<char*> words;
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));  // NOLINT: execve's type
  words.push_back(nullptr);
  pid_t id = 0;
  const int failed = ::posix_spawnp(&id, words[0], &actions, nullptr, words.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(pipe[1]);
  if (failed == 0) return ChildProcess(id, pipe[0]);
  ::close(pipe[0]);
  return Error{failed == ENOENT ? ErrorCode::NotFound : ErrorCode::Io,
               fmt::format("'{}' cannot be started: {}", command[0], std::strerror(failed))};
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : id_(std::exchange(other.id_, 0)),
      output_(std::exchange(other.output_, -1)),
      closed_(other.closed_),
      begun_(std::move(other.begun_)) {}

ChildProcess::~ChildProcess() {
  if (id_ != 0) {
    send(SIGKILL);
    (void)wait();
  }
  if (output_ >= 0) ::close(output_);
}

std::optional<std::vector<std::string>> ChildProcess::read() {
  if (closed_) return std::nullopt;
  std::array<char, 4096> bytes{};
  ssize_t count = 0;
  do {
    count = ::read(output_, bytes.data(), bytes.size());
  } while (count < 0 && errno == EINTR);
  if (count > 0) {
    begun_.append(bytes.data(), static_cast<std::size_t>(count));
    return take_lines(begun_);
  }
  closed_ = true;
  if (begun_.empty()) return std::nullopt;
  return std::vector<std::string>{std::move(begun_)};
}

Result<std::string> ChildProcess::output_of(const std::vector<std::string>& command, Duration patience) {
  Result<ChildProcess> process = start(command);
  if (!process) return process.error();
  const Timestamp until = host_now() + patience;
  std::string output;
  for (;;) {
    pollfd readable{process->descriptor(), POLLIN, 0};
    const int left_ms = static_cast<int>(std::ceil(1e3 * to_s(until - host_now())));
    if (left_ms <= 0) return Error{ErrorCode::Timeout, fmt::format("'{}' did not end", command[0])};
    if (::poll(&readable, 1, left_ms) <= 0) continue;
    const std::optional<std::vector<std::string>> lines = process->read();
    if (!lines) break;
    for (const std::string& line : *lines) output += line + "\n";
  }
  return output;
}

void ChildProcess::send(int signal) const noexcept {
  if (id_ != 0) ::kill(id_, signal);
}

ProcessEnd ChildProcess::wait() {
  int status = 0;
  while (id_ != 0 && ::waitpid(id_, &status, 0) < 0 && errno == EINTR) {
  }
  id_ = 0;
  if (WIFSIGNALED(status)) return {.signal = WTERMSIG(status)};
  return {.exit_code = WEXITSTATUS(status)};
}

}  // namespace mocap
