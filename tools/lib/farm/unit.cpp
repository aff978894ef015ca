#include "lib/farm/unit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <system_error>

#include "base/exit_codes.h"
#include "lib/takes/take_report.h"

namespace mocap::farm {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxWords_bytes = 4096;
constexpr std::string_view kProgram = "mocapctl: ";

Error wrong(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

}  // namespace

Result<std::vector<Unit>> make_units(const std::vector<fs::path>& takes, const fs::path& folder) {
  std::error_code error;
  if (!folder.empty()) fs::create_directories(folder, error);
  if (error) {
    return Error{ErrorCode::Io, fmt::format("the folder '{}' cannot be made: {}", folder.string(), error.message())};
  }
  std::vector<Unit> units;
  std::map<fs::path, fs::path> take_of_out;
  for (const fs::path& take : takes::takes_in(takes)) {
    Unit unit;
    unit.take = fs::absolute(take, error).lexically_normal();
    const fs::path out = folder.empty() ? default_out(take) : folder / (take.stem().string() + ".mcap");
    unit.out = fs::absolute(out, error).lexically_normal();
    const auto size = fs::file_size(unit.take, error);
    unit.bytes = error ? 0 : size;
    const auto [other, is_new] = take_of_out.emplace(unit.out, take);
    if (!is_new && other->second != take) {
      return wrong(fmt::format("'{}' and '{}' would both become '{}'; track them in two commands with two --out-dir",
                               other->second.string(), take.string(), unit.out.string()));
    }
    if (is_new) units.push_back(std::move(unit));
  }
  if (units.empty()) return wrong("there is no take (*.mcap) in the folders");
  return units;
}

std::vector<Unit> in_chunks(const std::vector<Unit>& units, std::uint32_t chunks) {
  std::vector<Unit> parts;
  for (const Unit& unit : units) {
    for (std::uint32_t number = 1; number <= chunks; ++number) {
      Unit& part = parts.emplace_back(unit);
      part.bytes = unit.bytes / chunks;
      part.chunk = retrack::Chunk{.number = number, .of = chunks};
    }
  }
  return parts;
}

fs::path file_of(const Unit& unit) { return unit.chunk ? retrack::chunk_file(unit.out, *unit.chunk) : unit.out; }

fs::path default_out(const fs::path& take) { return take.stem().string() + "-retracked.mcap"; }

std::vector<std::string> command_of(const UnitCommand& common, const Unit& unit) {
  std::vector<std::string> command{common.mocapctl.string(), "take",  "retrack",
                                   unit.take.string(),       "--out", unit.out.string()};
  if (unit.chunk) command.insert(command.end(), {"--chunk", to_text(*unit.chunk)});
  command.insert(command.end(), common.options.begin(), common.options.end());
  command.emplace_back("--json");
  return command;
}

std::vector<std::string> join_command(const fs::path& mocapctl, const fs::path& out, std::uint32_t chunks) {
  return {mocapctl.string(), "take",    "join", out.string(), "--chunks", std::to_string(chunks),
          "--remove-chunks", "--resume"};
}

void UnitOutput::add(std::string_view line) {
  const std::string text(line);
  double share = 0.0;
  if (std::sscanf(text.c_str(), "progress %lf", &share) == 1) {
    share_ = std::clamp(share, 0.0, 1.0);
    return;
  }
  auto json = line.starts_with('{') ? nlohmann::ordered_json::parse(line, nullptr, false) : nlohmann::ordered_json();
  if (json.is_object()) {
    report_ = std::move(json);
    return;
  }
  if (words_.size() > kMaxWords_bytes) return;
  if (!words_.empty()) words_ += '\n';
  words_ += line.starts_with(kProgram) ? line.substr(kProgram.size()) : line;
}

UnitResult UnitOutput::result(const ProcessEnd& ended) const {
  UnitResult result;
  if (ended.well() && report_.is_object()) {
    const auto kept = report_.find("kept");
    const bool was_there = kept != report_.end() && kept->is_boolean() && kept->get<bool>();
    result.kind = was_there ? UnitResult::Kind::Kept : UnitResult::Kind::Tracked;
    result.report = report_;
    return result;
  }
  result.exit_code = ended.exit_code != 0 ? ended.exit_code : static_cast<int>(kExitUnavailable);
  result.reason = words_;
  if (ended.signal != 0) {
    result.reason =
        fmt::format("the process was ended by signal {}{}{}", ended.signal, words_.empty() ? "" : ": ", words_);
  } else if (words_.empty()) {
    result.reason = fmt::format("exit code {}", ended.exit_code);
  }
  return result;
}

}  // namespace mocap::farm
