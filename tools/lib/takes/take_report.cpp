#include "lib/takes/take_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/list_folder.h"
#include "lib/json_depth.h"
#include "take/mcap/input_file.h"
#include "take/take_edit.h"
#include "take/take_quality.h"

namespace mocap::takes {

using nlohmann::ordered_json;

namespace {

constexpr const char* kFigures = "quality_figures";

std::string text_of(const take::TakeInfo& info, const char* key) {
  const auto found = info.others.find(key);
  return found == info.others.end() ? std::string() : found->second;
}

}  // namespace

double seconds_of(const take::TakeReader& reader) { return to_s(reader.last_at() - reader.first_at()); }

const char* state_of(const take::TakeReader& reader) {
  if (reader.is_being_written()) return "is being recorded";
  if (reader.cut_off()) return "cut off";
  if (!reader.mcap().damages().empty()) return "damaged";
  return reader.info().repaired ? "repaired" : "complete";
}

ordered_json quality_of(const take::TakeReader& reader) {
  const auto known = reader.info().others.find(kFigures);
  if (known != reader.info().others.end() && !is_deep(known->second)) {
    if (ordered_json json = ordered_json::parse(known->second, nullptr, false); json.is_object()) return json;
  }
  take::TakeMeter meter;
  if (const auto description = reader.description()) meter.describe(*description);
  take::TakeCursor cursor = reader.messages({{take::TakeTopic::Description, take::TakeTopic::Snapshot}, {}, {}});
  for (;;) {
    const auto record = cursor.next();
    if (!record || !*record) break;  // the rest of a damaged take cannot be read
    if ((*record)->topic == take::TakeTopic::Snapshot) {
      if (const auto snapshot = take::snapshot_message_of(**record)) meter.add(*snapshot);
    } else if (const auto description = take::description_of(**record)) {
      meter.describe(*description);
    }
  }
  return ordered_json::parse(take::to_json(meter.report()));
}

ordered_json json_of(const take::TakeReader& reader) {
  const take::TakeInfo& info = reader.info();
  const double seconds = seconds_of(reader);
  ordered_json json{{"file", reader.mcap().path()},
                    {"state", state_of(reader)},
                    {"cut_off", reader.cut_off()},
                    {"seconds", seconds},
                    {"bytes", reader.mcap().file().size()},
                    {"bytes_per_s", seconds > 0.0 ? static_cast<double>(reader.mcap().file().size()) / seconds : 0.0}};
  json["topics"] = ordered_json::object();
  for (const auto& [topic, count] : reader.counts()) {
    json["topics"][topic] = {{"messages", count},
                             {"rate_hz", seconds > 0.0 ? static_cast<double>(count) / seconds : 0.0}};
  }
  json["files"] = reader.files();
  json["info"] = take::encode(info).texts;
  json["info"].erase(kFigures);
  json["quality"] = quality_of(reader);
  json["damages"] = ordered_json::array();
  for (const auto& damage : reader.mcap().damages()) json["damages"].push_back(damage.what);
  return json;
}

ordered_json summary_of(const take::TakeReader& reader) {
  const take::TakeInfo& info = reader.info();
  ordered_json json{{"state", state_of(reader)},
                    {"slate", info.slate},
                    {"number", info.number},
                    {"seconds", seconds_of(reader)},
                    {"bytes", reader.mcap().file().size()},
                    {"quality", text_of(info, "quality")},
                    {"reasons", text_of(info, "quality_reasons")},
                    {"notes", info.notes},
                    {"tags", info.tags}};
  json["rating"] = info.rating ? ordered_json(*info.rating) : ordered_json();
  json["started"] = info.started_at ? take::utc_text(*info.started_at, info.utc_minus_host) : "";
  return json;
}

std::vector<std::filesystem::path> takes_in(std::vector<std::filesystem::path> places) {
  if (places.empty()) places.emplace_back(".");
  std::vector<std::filesystem::path> takes;
  for (const std::filesystem::path& place : places) {
    std::error_code error;
    if (!std::filesystem::is_directory(place, error)) {
      takes.push_back(place);
      continue;
    }
    for (const std::filesystem::path& file : list_folder(place).paths) {
      const bool is_hidden = file.filename().string().starts_with('.');  // a take that is not whole yet
      if (file.extension() == ".mcap" && !is_hidden) takes.push_back(file);
    }
  }
  std::sort(takes.begin(), takes.end());
  return takes;
}

Result<std::filesystem::path> rename(const std::filesystem::path& file, const std::string& name) {
  const auto opened = take::mcap::InputFile::open(file);
  if (!opened) return opened.error();
  // The recorder ends a take whose file is gone.
  if (opened->is_being_written()) {
    return Error{ErrorCode::Busy, fmt::format("'{}' is being recorded; stop the take first", file.string())};
  }
  // The file is renamed first, because only that can be refused.
  auto renamed = take::rename_take(file, name);
  if (!renamed) return renamed.error();
  take::TakeEdit edit;
  edit.name = name;
  if (const auto info = take::edit_take(*renamed, edit); !info) {
    (void)take::rename_take(*renamed, file.stem().string());
    return info.error();
  }
  return renamed;
}

}  // namespace mocap::takes
