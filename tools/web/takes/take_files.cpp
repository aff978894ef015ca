#include "web/takes/take_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "base/list_folder.h"
#include "lib/json_depth.h"
#include "lib/takes/take_report.h"
#include "take/take_edit.h"
#include "take/take_reader.h"

namespace mocap::web {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::size_t kMaxTakeName_bytes = 200;
constexpr std::size_t kMaxTakePiece_bytes = 4 * 1024 * 1024;
constexpr std::array<std::string_view, 3> kTakeChanges = {"edit", "rename", "delete"};

Error wrong_take(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

struct DatedFile {
  fs::path path;
  fs::file_time_type written;
};

ordered_json listed(const fs::path& file) {
  ordered_json json{{"name", file.stem().string()}};
  const auto reader = take::TakeReader::open(file);
  if (reader) {
    json.update(takes::summary_of(*reader));
  } else {
    json["state"] = "unreadable";
    json["reasons"] = reader.error().message;
  }
  return json;
}

// The value of `key`, which is absent or of type T.
template <class T>
Result<std::optional<T>> value_of(const nlohmann::json& params, const char* key, bool fits, const char* expected) {
  if (!params.contains(key)) return std::optional<T>();
  if (!fits) return wrong_take(fmt::format("{} is {}, expected {}", key, params[key].dump(), expected));
  return std::optional<T>(params[key].get<T>());
}

bool is_list_of_texts(const nlohmann::json& value) {
  return value.is_array() && std::ranges::all_of(value, [](const nlohmann::json& each) { return each.is_string(); });
}

Result<take::TakeEdit> edit_of(const nlohmann::json& params) {
  for (const auto& [key, value] : params.items()) {
    if (key != "notes" && key != "rating" && key != "tags" && key != "slate" && key != "number")
      return wrong_take(fmt::format("unknown key '{}', expected notes, rating, tags, slate or number", key));
  }
  const auto at = [&](const char* key) { return params.contains(key) ? params[key] : nlohmann::json(); };
  const auto notes = value_of<std::string>(params, "notes", at("notes").is_string(), "a text");
  if (!notes) return notes.error();
  const auto slate = value_of<std::string>(params, "slate", at("slate").is_string(), "a text");
  if (!slate) return slate.error();
  const bool rates = at("rating").is_number_integer() && at("rating") >= 0 && at("rating") <= take::kMaxRating;
  const auto rating = value_of<int>(params, "rating", rates, "0 to 5");
  if (!rating) return rating.error();
  const bool counts = at("number").is_number_unsigned() && at("number") <= 1'000'000;
  const auto number = value_of<std::uint32_t>(params, "number", counts, "0 to 1000000");
  if (!number) return number.error();
  const auto tags = value_of<std::vector<std::string>>(params, "tags", is_list_of_texts(at("tags")), "a list of texts");
  if (!tags) return tags.error();
  return take::TakeEdit{
      .name = {}, .slate = *slate, .number = *number, .notes = *notes, .tags = *tags, .rating = *rating};
}

Result<std::string> edit(const fs::path& file, const nlohmann::json& params) {
  const auto wish = edit_of(params);
  if (!wish) return wish.error();
  const auto info = take::edit_take(file, *wish);
  if (!info) return info.error();
  return file.stem().string() + ": changed";
}

Result<std::string> rename_file(const fs::path& file, const nlohmann::json& params) {
  if (!params.contains("name") || !params["name"].is_string()) return wrong_take("name is missing, expected a text");
  const std::string name = params["name"].get<std::string>();
  if (Result<fs::path> named = take_file(file.parent_path(), name);
      !named && named.error().code == ErrorCode::InvalidArgument)
    return named.error();
  const auto renamed = takes::rename(file, name);
  if (!renamed) return renamed.error();
  return fmt::format("{}: now {}", file.stem().string(), renamed->stem().string());
}

Status refuse_recording(const fs::path& file) {
  const auto reader = take::TakeReader::open(file);
  if (!reader || !reader->is_being_written()) return {};
  return Error{ErrorCode::Busy, file.stem().string() + " is being recorded; end the take first"};
}

Result<std::string> delete_file(const fs::path& file) {
  std::error_code error;
  if (!fs::remove(file, error))
    return Error{ErrorCode::Io, fmt::format("'{}' cannot be deleted: {}", file.string(), error.message())};
  return file.stem().string() + ": deleted";
}

static_assert(std::endian::native == std::endian::little, "the bytes of numbers are copied");

void append_message(std::string& into, char kind, double at_s, std::string_view bytes) {
  const auto size = static_cast<std::uint32_t>(1 + sizeof(at_s) + bytes.size());
  into.append(reinterpret_cast<const char*>(&size), sizeof(size));  // NOLINT: bytes of a number
  into.push_back(kind);
  into.append(reinterpret_cast<const char*>(&at_s), sizeof(at_s));  // NOLINT: bytes of a number
  into.append(bytes);
}

// At most a day, so that no number overflows.
Duration length_of(double seconds) {
  constexpr double kDay_s = 86400.0;
  return from_s(std::isfinite(seconds) ? std::clamp(seconds, 0.0, kDay_s) : 0.0);
}

// The last description before `from`, if there is one; otherwise nothing.
Status append_description(const take::TakeReader& reader, Timestamp from, std::string& piece) {
  take::TakeCursor cursor = reader.messages({{take::TakeTopic::Description}, {}, from, {}});
  std::string last;
  for (;;) {
    const auto record = cursor.next();
    if (!record) return record.error();
    if (!*record) break;
    last = (*record)->bytes;
  }
  if (!last.empty()) append_message(piece, 'd', to_s(from - reader.first_at()), last);
  return {};
}

}  // namespace

Result<fs::path> take_file(const fs::path& folder, const std::string& name) {
  const bool plain = std::ranges::none_of(name, [](unsigned char c) { return c < 0x20 || c == '/' || c == 0x7f; });
  if (name.empty() || name.size() > kMaxTakeName_bytes || name.front() == '.' || !plain)
    return wrong_take("the name of a take has 1 to 200 bytes, without '/', and does not begin with '.'");
  fs::path file = folder / (name + ".mcap");
  std::error_code error;
  if (fs::symlink_status(file, error).type() != fs::file_type::regular)
    return Error{ErrorCode::NotFound, fmt::format("there is no take '{}' in {}", name, folder.string())};
  return file;
}

Result<ordered_json> list_takes(const fs::path& folder) {
  const FolderContents contents = list_folder(folder);
  if (const std::error_code error = contents.error) {
    return Error{error == std::errc::no_such_file_or_directory ? ErrorCode::NotFound : ErrorCode::Io,
                 fmt::format("the folder of the takes {} cannot be read: {}; see --takes of mocap-web --help",
                             folder.string(), error.message())};
  }
  std::vector<DatedFile> files;
  for (const fs::path& file : contents.paths) {
    std::error_code gone;
    const bool is_hidden = file.filename().string().starts_with('.');  // `take_file` does not find it
    if (file.extension() == ".mcap" && !is_hidden && fs::symlink_status(file, gone).type() == fs::file_type::regular)
      files.push_back({file, fs::last_write_time(file, gone)});
  }
  std::ranges::sort(files, [](const DatedFile& a, const DatedFile& b) {
    return a.written != b.written ? a.written > b.written : a.path > b.path;
  });
  const std::size_t shown = std::min(files.size(), kMaxTakesListed);
  ordered_json takes = ordered_json::array();
  for (std::size_t i = 0; i < shown; ++i) takes.push_back(listed(files[i].path));
  return ordered_json{{"folder", folder.string()}, {"takes", std::move(takes)}, {"left_out", files.size() - shown}};
}

Result<ordered_json> show_take(const fs::path& file) {
  const auto reader = take::TakeReader::open(file);
  if (!reader) return reader.error();
  ordered_json json = listed(file);
  json["report"] = takes::json_of(*reader);
  return json;
}

Result<ordered_json> verify_take(const fs::path& file) {
  const auto faults = take::verify_take(file);
  if (!faults) return faults.error();
  ordered_json json{{"valid", faults->empty()}, {"faults", ordered_json::array()}};
  constexpr std::size_t kMaxFaults = 100;
  for (std::size_t i = 0; i < std::min(kMaxFaults, faults->size()); ++i) json["faults"].push_back((*faults)[i].what);
  return json;
}

bool is_take_change(std::string_view verb) { return std::ranges::find(kTakeChanges, verb) != kTakeChanges.end(); }

Result<std::string> change_take(const fs::path& file, std::string_view verb, const std::string& params) {
  if (is_deep(params)) return wrong_take(fmt::format("expected at most {} nested brackets", kMaxJsonDepth));
  const nlohmann::json json = nlohmann::json::parse(params.empty() ? "{}" : params, nullptr, false);
  if (!json.is_object()) return wrong_take("expected an object of JSON");
  if (const Status free = refuse_recording(file); !free) return free.error();
  if (verb == "edit") return edit(file, json);
  if (verb == "rename") return rename_file(file, json);
  return delete_file(file);
}

Result<std::string> take_piece(const fs::path& file, double from_s, double seconds) {
  const auto reader = take::TakeReader::open(file);
  if (!reader) return reader.error();
  const Timestamp start = reader->first_at(), from = start + length_of(from_s), to = from + length_of(seconds);
  std::string piece;
  if (const Status described = append_description(*reader, from, piece); !described) return described.error();
  take::TakeCursor cursor = reader->messages({{take::TakeTopic::Description, take::TakeTopic::Snapshot}, from, to, {}});
  while (piece.size() < kMaxTakePiece_bytes) {
    const auto record = cursor.next();
    if (!record) return record.error();
    if (!*record) break;
    const char kind = (*record)->topic == take::TakeTopic::Snapshot ? 's' : 'd';
    append_message(piece, kind, to_s((*record)->at - start), (*record)->bytes);
  }
  return piece;
}

}  // namespace mocap::web
