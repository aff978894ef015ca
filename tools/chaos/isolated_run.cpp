#include "chaos/isolated_run.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

namespace mocap::chaos {
namespace {

// An episode takes under 2 s on the slowest machine, under sanitizers 20 times as long.
constexpr rlim_t kMostCpu_s = 120;
constexpr const char* kCrash = "the daemon does not crash";

Error no_process(const char* what) {
  return {ErrorCode::Io, fmt::format("{}: {}", what, std::strerror(errno))};  // NOLINT(concurrency-mt-unsafe)
}

std::string encode(const Result<Verdict>& verdict) {
  if (!verdict) return "error\n" + verdict.error().message;
  const Failure failure = verdict->failure.value_or(Failure{});
  return fmt::format("{}\n{} {} {} {}\n{}\n{}", verdict->failure ? "failed" : "fine", verdict->hash, verdict->sets,
                     failure.t_s, failure.step, failure.invariant, failure.words);
}

std::string rest_of(std::istream& stream) { return {std::istreambuf_iterator<char>(stream), {}}; }

// Nothing: the text is not whole.
std::optional<Result<Verdict>> decode(const std::string& text) {
  std::istringstream stream(text);
  std::string kind;
  if (!std::getline(stream, kind)) return std::nullopt;
  if (kind == "error") return Result<Verdict>(Error{ErrorCode::Io, rest_of(stream)});
  Verdict verdict;
  Failure failure;
  if (!(stream >> verdict.hash >> verdict.sets >> failure.t_s >> failure.step)) return std::nullopt;
  std::getline(stream, failure.invariant);
  std::getline(stream, failure.invariant);
  failure.words = rest_of(stream);
  if (kind == "failed") verdict.failure = failure;
  return Result<Verdict>(verdict);
}

std::string read_whole(int file) {
  std::string text;
  char bytes[4096];
  for (;;) {
    const ssize_t got = ::read(file, bytes, sizeof bytes);
    if (got > 0) text.append(bytes, static_cast<std::size_t>(got));
    if (got == 0 || (got < 0 && errno != EINTR)) return text;
  }
}

std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

[[noreturn]] void run_in_child(const Episode& episode, const std::filesystem::path& folder, int result, int log) {
  ::dup2(log, STDERR_FILENO);
  const rlimit most{kMostCpu_s, kMostCpu_s + 1};
  ::setrlimit(RLIMIT_CPU, &most);
  const std::string text = encode(run_twice(episode, folder));
  for (std::string_view left = text; !left.empty();) {
    const ssize_t written = ::write(result, left.data(), left.size());
    if (written <= 0) break;
    left.remove_prefix(static_cast<std::size_t>(written));
  }
  ::_exit(0);
}

}  // namespace

Result<IsolatedRun> IsolatedRun::start(const Episode& episode, const std::filesystem::path& folder) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return no_process("no pipe can be made");
  const int log = ::memfd_create("mocap-chaos", MFD_CLOEXEC);
  const pid_t process = log < 0 ? -1 : ::fork();
  if (process == 0) {
    ::close(ends[0]);
    run_in_child(episode, folder, ends[1], log);
  }
  ::close(ends[1]);
  if (process > 0) return IsolatedRun(process, ends[0], log);
  const Error error = no_process("no process can be started");
  IsolatedRun(process, ends[0], log).close_files();
  return error;
}

IsolatedRun::IsolatedRun(IsolatedRun&& other) noexcept
    : process_(std::exchange(other.process_, -1)),
      result_(std::exchange(other.result_, -1)),
      log_(std::exchange(other.log_, -1)) {}

IsolatedRun& IsolatedRun::operator=(IsolatedRun&& other) noexcept {
  std::swap(process_, other.process_);
  std::swap(result_, other.result_);
  std::swap(log_, other.log_);
  return *this;
}

IsolatedRun::~IsolatedRun() {
  if (process_ > 0) ::waitpid(process_, nullptr, 0);
  close_files();
}

void IsolatedRun::close_files() noexcept {
  for (int* file : {&result_, &log_}) {
    if (*file >= 0) ::close(std::exchange(*file, -1));
  }
}

Result<Verdict> IsolatedRun::finish() {
  const std::string text = read_whole(result_);
  int status = 0;
  ::waitpid(std::exchange(process_, -1), &status, 0);
  if (auto verdict = decode(text)) return *std::move(verdict);
  ::lseek(log_, 0, SEEK_SET);
  const std::string last = last_line(read_whole(log_));
  const std::string how = WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU
                              ? fmt::format("no end within {} s of CPU time", kMostCpu_s)
                          : WIFSIGNALED(status) ? fmt::format("signal {}", WTERMSIG(status))
                                                : fmt::format("exit code {}", WEXITSTATUS(status));
  Verdict verdict;
  verdict.failure = Failure{kCrash, how + ": " + last, 0.0, 0};
  return verdict;
}

}  // namespace mocap::chaos
