#include "settings/packed_files.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include "base/install_folders.h"
#include "base/literal_text.h"
#include "settings/shipped_files.h"
#include "settings/toml/text_edit.h"
#include "settings/toml/text_file.h"
#include "settings/toml/toml_file.h"

namespace mocap::settings {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kConfiguration = "configuration";
constexpr std::string_view kState = "state";
constexpr std::string_view kRig = "rig";
constexpr std::string_view kMarkerSets = "markersets";
constexpr std::string_view kSkeletons = "skeletons";
constexpr std::string_view kSubjects = "subjects";
constexpr std::array kFolders{kConfiguration, kState, kRig, kMarkerSets, kSkeletons, kSubjects};

// A longer path than any that a file has here: "markersets/hall/baseline41.toml".
constexpr std::ptrdiff_t kMostParts = 8;

// Collects files; each is read once.
class Packer {
 public:
  void add(std::string_view folder, const fs::path& path) {
    if (path.empty() || std::ranges::find(paths_, path) != paths_.end()) return;
    fs::path name = fs::path(folder) / path.filename();
    if (has(name)) name = fs::path(folder) / path.parent_path().filename() / path.filename();
    add_as(name.string(), path);
  }

  void add_as(const std::string& name, const fs::path& path) {
    const Result<std::string, Fault> text = read_text(path);
    if (!text || has(name)) return;
    paths_.push_back(path);
    files_.push_back({name, *text});
  }

  void add_marker_set(const fs::path& path) {
    add(kMarkerSets, path);
    if (const auto skeleton = named_in(path, "skeleton", install_folders().data / "markersets")) {
      add(kSkeletons, *skeleton);
    }
  }

  void add_body(const std::string& subject, const fs::path& path) {
    std::error_code ignored;
    if (path.empty() || !fs::exists(path, ignored)) return;
    add_as(name_of_body(subject), path);
    if (const auto set = named_in(path, "marker_set", install_folders().data)) add_marker_set(*set);
  }

  std::vector<PackedFile> files() { return std::move(files_); }

 private:
  bool has(const fs::path& name) const {
    return std::ranges::find(files_, name.string(), &PackedFile::name) != files_.end();
  }

  // The file that a key of a TOML file names, as its reader finds it.
  static std::optional<fs::path> named_in(const fs::path& path, const char* key, const fs::path& shipped) {
    Result<TomlFile, Faults> file = TomlFile::open(path);
    if (!file) return std::nullopt;
    std::string named;
    file->root().text(key, named);
    if (named.empty()) return std::nullopt;
    return find_file(named, path.parent_path(), shipped).path;
  }

  std::vector<fs::path> paths_;
  std::vector<PackedFile> files_;
};

bool is_harmless(const fs::path& name) {
  if (name.empty() || name.is_absolute() || std::distance(name.begin(), name.end()) > kMostParts) return false;
  if (std::ranges::find(kFolders, name.begin()->string()) == kFolders.end()) return false;
  return std::distance(name.begin(), name.end()) >= 2 &&
         std::ranges::none_of(name, [](const fs::path& part) { return part.empty() || part == ".." || part == "."; });
}

// How well a path matches the name of a packed file: twice the number of last parts that both have, and one more if
// these are all parts of the name after its folder.
std::size_t match_of(const fs::path& path, const fs::path& name) {
  std::size_t common = 0;
  for (auto a = path.end(), b = name.end(); a != path.begin() && b != name.begin() && *--a == *--b;) ++common;
  const auto parts = static_cast<std::size_t>(std::distance(name.begin(), name.end())) - 1;
  return common == 0 ? 0 : 2 * common + (common >= parts ? 1 : 0);
}

// Replaces the paths in the text of one file.
class PathReplacer {
 public:
  PathReplacer(const std::vector<PackedFile>& files, const fs::path& folder, const PackedFile& file)
      : files_(files), folder_(folder), file_(file), lines_(file.bytes) {}

  Result<std::string> replaced() {
    try {
      const toml::table root = toml::parse(file_.bytes, file_.name);
      const std::string kind = fs::path(file_.name).begin()->string();
      if (kind == kConfiguration || kind == kState) replace_in_configuration(root);
      if (kind == kMarkerSets) replace(root["skeleton"].node(), kSkeletons);
      if (kind == kSubjects) replace(root["marker_set"].node(), kMarkerSets);
    } catch (const toml::parse_error& error) {
      return Error{ErrorCode::InvalidArgument, fmt::format("{}:{}:{}: {}", file_.name, error.source().begin.line,
                                                           error.source().begin.column, error.description())};
    }
    if (fault_) return *fault_;
    return edited(file_.bytes, std::move(edits_));
  }

 private:
  void replace_in_configuration(const toml::table& root) {
    // A configuration has one rig.
    if (const toml::node* rig = root["capture"]["rig"].node()) replace(rig, kRig);
    for_each_table(root, "camera", [&](const toml::table& camera) { replace(camera.get("marker_set"), kMarkerSets); });
    for_each_table(root, "subject", [&](const toml::table& subject) { replace_in_subject(subject); });
  }

  template <class Visit>
  static void for_each_table(const toml::table& root, const char* key, Visit visit) {
    const toml::array* tables = root.get_as<toml::array>(key);
    if (tables == nullptr) return;
    for (const toml::node& table : *tables) {
      if (const toml::table* one = table.as_table()) visit(*one);
    }
  }

  // The body is that of the take; fits that were kept later do not count.
  void replace_in_subject(const toml::table& subject) {
    replace(subject.get("marker_set"), kMarkerSets);
    const toml::node* name = subject.get("name");
    if (name == nullptr || !name->is_string()) return;
    const std::string body = name_of_body(*name->value<std::string>());
    const bool packed = std::ranges::find(files_, body, &PackedFile::name) != files_.end();
    const std::string path = packed ? (folder_ / body).string() : std::string();
    if (const toml::node* keep = subject.get("keep")) set(*keep, "");
    if (const toml::node* file = subject.get("file")) {
      set(*file, path);
    } else if (packed) {
      const std::size_t end = offset_of(name->source().end);
      const char* between = subject.is_inline() ? ", " : "\n";
      edits_.push_back({end, end, fmt::format("{}file = {}", between, quoted_text(path))});
    }
  }

  // Replaces a path by that of the packed file that matches it best. A path without such a file stays: it
  // may name a shipped file.
  void replace(const toml::node* node, std::string_view kind) {
    if (node == nullptr || !node->is_string()) return;
    const fs::path named = *node->value<std::string>();
    const PackedFile* best = nullptr;
    std::size_t most = 0;
    bool unsure = false;
    for (const PackedFile& file : files_) {
      if (*fs::path(file.name).begin() != fs::path(kind)) continue;
      const std::size_t match = kind == kRig ? 1 : match_of(named, file.name);
      if (match == 0 || match < most) continue;
      unsure = match == most;
      best = &file;
      most = match;
    }
    if (best == nullptr) return;
    if (unsure) {
      fault_ = Error{ErrorCode::InvalidArgument, fmt::format("{}:{}: '{}' may be one of several files of the take",
                                                             file_.name, node->source().begin.line, named.string())};
    }
    set(*node, (folder_ / best->name).string());
  }

  void set(const toml::node& node, const std::string& text) {
    edits_.push_back({offset_of(node.source().begin), offset_of(node.source().end), quoted_text(text)});
  }

  std::size_t offset_of(const toml::source_position& at) const { return lines_.offset_of(at.line, at.column); }

  const std::vector<PackedFile>& files_;
  const fs::path& folder_;
  const PackedFile& file_;
  LineIndex lines_;
  std::vector<TextEdit> edits_;
  std::optional<Error> fault_;
};

Status write_file(const fs::path& path, const std::string& text) {
  std::error_code failed;
  fs::create_directories(path.parent_path(), failed);
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (out) return {};
  return Error{ErrorCode::Io, fmt::format("cannot write {}", path.string())};
}

}  // namespace

std::string name_of_body(const std::string& subject) {
  std::string name = subject;
  std::ranges::replace(name, '/', '_');
  return fmt::format("{}/{}.toml", kSubjects, name);
}

std::vector<PackedFile> pack_files(const DaemonSettings& settings) {
  Packer packer;
  packer.add(kConfiguration, settings.file);
  packer.add(kState, settings.state.added_subjects);
  packer.add(kRig, settings.capture.rig_file);
  for (const cameras::CameraSettings& camera : settings.cameras) {
    const fs::path simulated = facts_of(camera).marker_set;
    const fs::path beside = settings.file.parent_path();
    if (!simulated.empty()) packer.add_marker_set(find_shipped(simulated.lexically_proximate(beside), beside).path);
  }
  for (const SubjectSettings& subject : settings.subjects) {
    if (!subject.marker_set_file.empty()) packer.add_marker_set(subject.marker_set_file);
    packer.add_body(subject.name, subject.file.empty() ? subject.keep : subject.file);
  }
  return packer.files();
}

Result<UnpackedFiles> unpack_files(const std::vector<PackedFile>& files, const fs::path& folder) {
  std::vector<PackedFile> wanted;
  std::ranges::copy_if(files, std::back_inserter(wanted),
                       [](const PackedFile& file) { return is_harmless(file.name); });
  UnpackedFiles unpacked;
  for (const PackedFile& file : wanted) {
    const Result<std::string> text = PathReplacer(wanted, folder, file).replaced();
    if (!text) return text.error();
    if (const Status written = write_file(folder / file.name, *text); !written) return written.error();
    const fs::path name = file.name;
    if (*name.begin() == fs::path(kConfiguration)) unpacked.configuration = folder / name;
    if (*name.begin() == fs::path(kState)) unpacked.state = state_files((folder / name).parent_path());
  }
  if (unpacked.configuration.empty()) return Error{ErrorCode::NotFound, "has no configuration among its files"};
  return unpacked;
}

}  // namespace mocap::settings
