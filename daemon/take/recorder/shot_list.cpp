#include "take/recorder/shot_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "base/read_file.h"
#include "base/replace_file.h"
#include "take/take_info.h"
#include "take/take_name.h"

namespace mocap::take {
namespace {

constexpr double kLongest_s = 7 * 86400.0;
constexpr std::array<std::string_view, 5> kColumns = {"name", "slate", "notes", "seconds", "done"};
enum Column : std::size_t { kName, kSlate, kNotes, kSeconds, kDone };
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

Error wrong_shot(std::string what) { return {ErrorCode::InvalidArgument, std::move(what)}; }

struct Row {
  std::size_t line = 0;  // of its first byte, from 1
  std::vector<std::string> cells;

  bool empty() const { return cells.size() == 1 && cells[0].empty(); }
};

// Splits CSV into rows. A quoted cell may have commas, newlines and doubled quotes.
class Rows {
 public:
  explicit Rows(std::string_view text) : text_(text) {}

  // Nothing at the end.
  Result<std::optional<Row>> next() {
    if (at_ >= text_.size()) return std::optional<Row>();
    Row row;
    row.line = line_;
    for (;;) {
      Result<std::string> cell = text_.substr(at_).starts_with('"') ? quoted() : plain();
      if (!cell) return cell.error();
      row.cells.push_back(*std::move(cell));
      if (!skip(',')) break;
    }
    skip('\r');
    if (at_ < text_.size() && !skip('\n')) return wrong_shot("expected a comma after the closing quote");
    ++line_;
    return std::optional<Row>(std::move(row));
  }
  std::size_t line() const { return line_; }

 private:
  bool skip(char c) {
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  Result<std::string> plain() {
    const std::size_t end = std::min(text_.find_first_of(",\r\n", at_), text_.size());
    std::string cell(text_.substr(at_, end - at_));
    at_ = end;
    return cell;
  }

  Result<std::string> quoted() {
    std::string cell;
    for (++at_; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '"' && text_.substr(at_ + 1).starts_with('"')) {
        ++at_;
      } else if (c == '"') {
        ++at_;
        return cell;
      }
      if (c == '\n') ++line_;
      cell += c;
    }
    return wrong_shot("a quote is not closed");
  }

  std::string_view text_;
  std::size_t at_ = 0, line_ = 1;
};

std::string trimmed(const std::string& text) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t'; };
  const auto first = std::find_if_not(text.begin(), text.end(), is_space);
  const auto last = std::find_if_not(text.rbegin(), text.rend(), is_space).base();
  return first < last ? std::string(first, last) : std::string();
}

Status check_notes(const std::string& notes) {
  if (notes.size() > kMaxShotNotes_bytes) {
    return wrong_shot(fmt::format("notes has {} bytes, expected at most {}", notes.size(), kMaxShotNotes_bytes));
  }
  if (plain_text(notes) == notes) return {};
  return wrong_shot("notes has control characters, expected text and newlines");
}

// The column of each cell of the header.
Result<std::vector<std::size_t>> columns_of(const Row& header) {
  std::vector<std::size_t> columns;
  for (const std::string& cell : header.cells) {
    const auto found = std::ranges::find(kColumns, trimmed(cell));
    if (found == kColumns.end()) {
      return wrong_shot(fmt::format(
          "unknown column '{}', expected a header of name, slate, notes, seconds with commas between", cell));
    }
    const auto column = static_cast<std::size_t>(found - kColumns.begin());
    if (std::ranges::find(columns, column) != columns.end())
      return wrong_shot(fmt::format("column '{}' occurs twice", cell));
    columns.push_back(column);
  }
  if (std::ranges::find(columns, std::size_t{kName}) == columns.end())
    return wrong_shot("the header has no column 'name'");
  return columns;
}

Result<Duration> length_of(const std::string& text) {
  if (text.empty()) return Duration{};
  double seconds = 0.0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), seconds);
  if (fault != std::errc() || end != text.data() + text.size() || !(seconds >= 0.0 && seconds <= kLongest_s)) {
    return wrong_shot(fmt::format("seconds is '{}', expected 0 to {:.0f}", text, kLongest_s));
  }
  return from_s(seconds);
}

Result<Shot> shot_of(const Row& row, const std::vector<std::size_t>& columns) {
  if (row.cells.size() > columns.size()) {
    return wrong_shot(fmt::format("the line has {} cells, the header {}; quote a text with commas", row.cells.size(),
                                  columns.size()));
  }
  std::array<std::string, kColumns.size()> cells;
  for (std::size_t i = 0; i < row.cells.size(); ++i) cells[columns[i]] = trimmed(row.cells[i]);
  const Result<Duration> length = length_of(cells[kSeconds]);
  if (!length) return length.error();
  const std::string notes = trimmed(plain_text(cells[kNotes]));
  Shot shot{cells[kName], cells[kSlate], notes, *length, cells[kDone] == "yes"};
  if (const Status valid = check_name(shot.name, "name"); !valid) return valid.error();
  if (!shot.slate.empty()) {
    if (const Status valid = check_name(shot.slate, "slate"); !valid) return valid.error();
  }
  if (const Status valid = check_notes(shot.notes); !valid) return valid.error();
  return shot;
}

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string cell = "\"";
  for (const char c : text) cell += c == '"' ? std::string("\"\"") : std::string(1, c);
  return cell + '"';
}

}  // namespace

Result<std::vector<Shot>> parse_shots(std::string_view csv, const std::string& file) {
  if (csv.starts_with(kByteOrderMark)) csv.remove_prefix(kByteOrderMark.size());
  Rows rows(csv);
  std::vector<std::size_t> columns;
  std::vector<Shot> shots;
  std::map<std::string, std::size_t> lines;  // of the names
  const auto at = [&](std::size_t line, const Error& error) {
    return Error{error.code, fmt::format("{}:{}: {}", file, line, error.message)};
  };
  for (;;) {
    const Result<std::optional<Row>> row = rows.next();
    if (!row) return at(rows.line(), row.error());
    if (!*row) break;
    if ((*row)->empty()) continue;
    if (columns.empty()) {
      Result<std::vector<std::size_t>> header = columns_of(**row);
      if (!header) return at((*row)->line, header.error());
      columns = *std::move(header);
      continue;
    }
    Result<Shot> shot = shot_of(**row, columns);
    if (!shot) return at((*row)->line, shot.error());
    const auto [first, is_new] = lines.emplace(shot->name, (*row)->line);
    if (!is_new)
      return at((*row)->line, wrong_shot(fmt::format("name '{}' is in line {} already", shot->name, first->second)));
    shots.push_back(*std::move(shot));
  }
  if (columns.empty()) return at(1, wrong_shot("the file is empty, expected a header of name, slate, notes, seconds"));
  if (const Status valid = check_shots(shots); !valid)
    return Error{valid.error().code, file + ": " + valid.error().message};
  return shots;
}

std::string shots_csv(const std::vector<Shot>& shots) {
  std::string text = fmt::format("{}\n", fmt::join(kColumns, ","));
  for (const Shot& shot : shots) {
    text += fmt::format("{},{},{},{},{}\n", quoted(shot.name), quoted(shot.slate), quoted(shot.notes),
                        shot.length == Duration::zero() ? "" : fmt::format("{}", to_s(shot.length)),
                        shot.done ? "yes" : "");
  }
  return text;
}

Status check_shots(const std::vector<Shot>& shots) {
  std::size_t bytes = 0;
  std::map<std::string, std::size_t> names;
  for (const Shot& shot : shots) {
    if (const Status valid = check_name(shot.name, "name"); !valid) return valid;
    if (!shot.slate.empty()) {
      if (const Status valid = check_name(shot.slate, "slate"); !valid) return valid;
    }
    if (const Status valid = check_notes(shot.notes); !valid)
      return wrong_shot(fmt::format("shot '{}': {}", shot.name, valid.error().message));
    bytes += shot.name.size() + shot.slate.size() + shot.notes.size();
    if (++names[shot.name] > 1) return wrong_shot(fmt::format("the shot list has '{}' twice", shot.name));
  }
  if (shots.size() > kMaxShots || bytes > kMaxShotList_bytes) {
    return wrong_shot(fmt::format("the shot list has {} shots and {} bytes, expected at most {} and {}; split it",
                                  shots.size(), bytes, kMaxShots, kMaxShotList_bytes));
  }
  return {};
}

Status ShotList::load() {
  std::error_code none;
  if (path_.empty() || !std::filesystem::exists(path_, none)) return {};
  const Result<std::string> text = read_file(path_);
  if (!text) return text.error();
  Result<std::vector<Shot>> shots = parse_shots(*text, path_.string());
  if (!shots) return shots.error();
  shots_ = *std::move(shots);
  return {};
}

std::size_t ShotList::left() const noexcept {
  return static_cast<std::size_t>(std::ranges::count(shots_, false, &Shot::done));
}

const Shot* ShotList::next() const noexcept {
  const auto found = std::ranges::find(shots_, false, &Shot::done);
  return found == shots_.end() ? nullptr : &*found;
}

std::string ShotList::words() const {
  if (shots_.empty()) return "the shot list is empty; mocapctl take shots import fills it";
  const Shot* following = next();
  return fmt::format("{} shots, {} left{}", shots_.size(), left(),
                     following != nullptr ? fmt::format(", next '{}'", following->name) : "");
}

Status ShotList::replace(std::vector<Shot> shots) {
  if (const Status valid = check_shots(shots); !valid) return valid;
  if (const Status saved = save(shots); !saved) return saved;
  shots_ = std::move(shots);
  return {};
}

Status ShotList::set_done(const std::string& name, bool done) {
  const auto found = std::ranges::find(shots_, name, &Shot::name);
  if (found == shots_.end() || found->done == done) return {};
  found->done = done;
  return save(shots_);
}

Status ShotList::save(const std::vector<Shot>& shots) const {
  if (path_.empty()) return {};
  std::error_code none;
  std::filesystem::create_directories(path_.parent_path(), none);  // replace_file reports the failure
  return replace_file(path_, shots_csv(shots));
}

}  // namespace mocap::take
