#include "corpus/table.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "base/replace_file.h"

namespace mocap::corpus {
namespace {

constexpr const char* kReason = "# reason: ";
constexpr const char* kColumns = "# recording\tsets\tlabels\tfilled\tjudged\twrong\trms\tread\ttaken\thash";

// One set more or less at the edge of a patience, and the labels of one set of 18 markers: a rounding that differs may
// move them.
constexpr double kShare = 0.005;
constexpr double kSets = 1.0, kLabels = 18.0, kWrong = 2.0;
constexpr double kLeastRms = 0.002, kRmsShare = 0.02;  // mm or px

std::string differs(const char* what, double frozen, double now, double allowed) {
  if (std::abs(now - frozen) <= allowed) return "";
  return fmt::format("{} {:g}, frozen {:g} +- {:.3g}; ", what, now, frozen, allowed);
}

std::string counts_differ(const char* what, std::uint64_t frozen, std::uint64_t now, double least) {
  const auto before = static_cast<double>(frozen);
  return differs(what, before, static_cast<double>(now), least + kShare * before);
}

}  // namespace

Result<Table> read_table(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) {
    return Error{ErrorCode::NotFound, path.string() + ": cannot be read; tools/corpus.sh --rewrite REASON writes it"};
  }
  Table table;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.starts_with(kReason)) table.reason = line.substr(std::string(kReason).size());
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    std::string name;
    Figures row;
    words >> name >> row.sets >> row.labels >> row.filled >> row.judged >> row.wrong >> row.rms >> row.read >>
        row.taken >> std::hex >> row.hash;
    if (words.fail()) {
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("{}:{}: expected a name and nine numbers", path.string(), number)};
    }
    table.figures[name] = row;
  }
  return table;
}

Status write_table(const std::filesystem::path& path, const Table& table) {
  std::string text = "# The frozen figures of tests/corpus; tools/corpus.sh compares and rewrites them.\n";
  text += kReason + table.reason + "\n" + kColumns + "\n";
  for (const auto& [name, row] : table.figures) {
    text += fmt::format("{}\t{}\t{}\t{}\t{}\t{}\t{:.3f}\t{}\t{}\t{:016x}\n", name, row.sets, row.labels, row.filled,
                        row.judged, row.wrong, row.rms, row.read, row.taken, row.hash);
  }
  return replace_file(path, text);
}

std::string difference(const Figures& frozen, const Figures& now) {
  return (now.fault.empty() ? "" : now.fault + "; ") + counts_differ("sets", frozen.sets, now.sets, kSets) +
         counts_differ("labels", frozen.labels, now.labels, kLabels) +
         counts_differ("filled", frozen.filled, now.filled, kLabels) +
         counts_differ("judged", frozen.judged, now.judged, kLabels) +
         counts_differ("wrong", frozen.wrong, now.wrong, kWrong) +
         differs("rms", frozen.rms, now.rms, kLeastRms + kRmsShare * frozen.rms) +
         counts_differ("read", frozen.read, now.read, kSets) + counts_differ("taken", frozen.taken, now.taken, kSets);
}

}  // namespace mocap::corpus
