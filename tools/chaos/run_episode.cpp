#include "chaos/run_episode.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "chaos/episode_run.h"

namespace mocap::chaos {
namespace {

namespace fs = std::filesystem;

// A new folder that is removed with its content.
class NewFolder {
 public:
  static Result<NewFolder> make(const fs::path& in) {
    std::string name = (in / "mocap-chaos-XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) return NewFolder(name);
    return Error{ErrorCode::Io, fmt::format("no folder can be made in '{}': {}", in.string(),
                                            std::strerror(errno))};  // NOLINT(concurrency-mt-unsafe)
  }
  NewFolder(NewFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;
  NewFolder& operator=(NewFolder&&) = delete;
  ~NewFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }

  const fs::path& path() const noexcept { return path_; }

 private:
  explicit NewFolder(fs::path path) : path_(std::move(path)) {}
  fs::path path_;
};

}  // namespace

Result<Verdict> run_episode(const Episode& episode, const fs::path& folder, const Sabotage& sabotage) {
  Result<Stage> stage = Stage::make(episode);
  if (!stage) return stage.error();
  const Result<NewFolder> own = NewFolder::make(folder);
  if (!own) return own.error();
  EpisodeRun run(episode, *std::move(stage), own->path() / "takes", sabotage);
  return run.run();
}

Result<Verdict> run_twice(const Episode& episode, const fs::path& folder, const Sabotage& sabotage) {
  Result<Verdict> first = run_episode(episode, folder, sabotage);
  if (!first || first->failure) return first;
  const Result<Verdict> second = run_episode(episode, folder, sabotage);
  if (!second || second->failure) return second;
  if (first->hash != second->hash) {
    first->failure =
        Failure{"the same seed gives the same hash", fmt::format("{:016x}, then {:016x}", first->hash, second->hash),
                episode.seconds, first->sets};
  }
  return first;
}

}  // namespace mocap::chaos
