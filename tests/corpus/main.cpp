// mocap-corpus: makes and checks the corpus of recordings. tools/corpus.sh calls it.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "base/log.h"
#include "corpus/figures.h"
#include "corpus/image_figures.h"
#include "corpus/make_corpus.h"
#include "corpus/table.h"

namespace mocap::corpus {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUsage =
    "usage: mocap-corpus check FOLDER\n"
    "       mocap-corpus rewrite FOLDER REASON     the figures of today become the frozen ones\n"
    "       mocap-corpus make FOLDER               simulates the recordings; the folder has none\n"
    "\n"
    "exit codes: 0 as frozen, 64 wrong command line, 65 a figure differs, 66 a file cannot be read, 73 cannot write\n";

int fail(const Error& error) {
  fmt::print(stderr, "mocap-corpus: {}\n", error.message);
  return error.code == ErrorCode::Io || error.code == ErrorCode::Busy ? kExitCannotWrite : kExitNoInput;
}

// Recordings (.mcap) and images (.png).
std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path kind = entry.path().extension();
    if (kind == ".mcap" || kind == ".png") paths.push_back(entry.path());
  }
  std::ranges::sort(paths);
  return paths;
}

Result<Figures> figures_of_file(const fs::path& path, const fs::path& world) {
  if (path.extension() == ".png") return image_figures_of(path);
  const auto recording = read_recording(path);
  if (!recording) return recording.error();
  return figures_of(*recording, world);
}

Result<Table> table_of(const fs::path& folder) {
  Table table;
  for (const fs::path& path : entries_of(folder)) {
    const auto figures = figures_of_file(path, folder / "world");
    if (!figures) return Error{figures.error().code, path.string() + ": " + figures.error().message};
    table.figures[path.stem().string()] = *figures;
  }
  if (table.figures.empty()) return Error{ErrorCode::NotFound, folder.string() + ": has no recordings"};
  return table;
}

int check(const fs::path& folder) {
  const auto frozen = read_table(folder / "table.tsv");
  if (!frozen) return fail(frozen.error());
  const auto now = table_of(folder);
  if (!now) return fail(now.error());
  std::size_t different = 0, equal = 0;
  const auto tell = [&](const std::string& name, const std::string& what) {
    ++different;
    fmt::print("{}: {}\n", name, what);
  };
  for (const auto& [name, figures] : now->figures) {
    const auto before = frozen->figures.find(name);
    if (before == frozen->figures.end()) {
      tell(name, "has no line in the table");
      continue;
    }
    const std::string differs = difference(before->second, figures);
    if (!differs.empty()) tell(name, differs);
    equal += figures.hash == before->second.hash ? 1 : 0;
  }
  for (const auto& [name, figures] : frozen->figures) {
    if (!now->figures.contains(name)) tell(name, "is in the table, and there is no such recording");
  }
  fmt::print("{} recordings, {} differ; {} have the same bytes as when the table was written\n", now->figures.size(),
             different, equal);
  return different == 0 ? kExitOk : kExitData;
}

int rewrite(const fs::path& folder, const std::string& reason) {
  auto table = table_of(folder);
  if (!table) return fail(table.error());
  for (const auto& [name, figures] : table->figures) {
    if (!figures.fault.empty()) return fail({ErrorCode::InvalidArgument, name + ": " + figures.fault});
  }
  table->reason = reason;
  const Status written = write_table(folder / "table.tsv", *table);
  return written ? kExitOk : fail(written.error());
}

int main_of(const std::vector<std::string>& words) {
  set_log_level(LogLevel::Error);
  if (words.size() == 2 && words[0] == "check") return check(words[1]);
  if (words.size() == 3 && words[0] == "rewrite" && !words[2].empty()) return rewrite(words[1], words[2]);
  if (words.size() == 2 && words[0] == "make") {
    const Status made = make_corpus(words[1]);
    return made ? kExitOk : fail(made.error());
  }
  fmt::print(stderr, "{}", kUsage);
  return kExitUsage;
}

}  // namespace
}  // namespace mocap::corpus

int main(int argc, char** argv) { return mocap::corpus::main_of({argv + 1, argv + argc}); }
