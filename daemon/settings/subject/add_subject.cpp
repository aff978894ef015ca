#include "settings/subject/add_subject.h"

#include <fmt/format.h>

#include <fstream>
#include <system_error>

#include "base/expects.h"
#include "base/file_name.h"
#include "base/replace_file.h"

namespace mocap::settings {
namespace {

Error cannot(const std::filesystem::path& file, const std::error_code& why) {
  return {ErrorCode::Io,
          fmt::format("cannot write {}: {}; let the daemon's user write there, or add the [[subject]] by "
                      "hand and mocapctl reload",
                      file.string(), why ? why.message() : "the disk may be full")};
}

std::string text_of(const NewSubject& subject) {
  return fmt::format("\n[[subject]]\nname = \"{}\"\nmarker_set = \"{}\"\n", subject.name, subject.marker_set.string());
}

// Appends to `tried`, and renames it to `file` if it has no faults; otherwise removes it.
Status append_and_replace(const std::filesystem::path& tried, const std::string& text,
                          const std::filesystem::path& file,
                          const std::function<Faults(const std::filesystem::path&)>& faults_of) {
  std::error_code failed;
  std::ofstream out(tried, std::ios::app | std::ios::binary);
  out << text;
  out.close();
  const Faults faults = out ? faults_of(tried) : Faults{};
  if (out && faults.list.empty()) std::filesystem::rename(tried, file, failed);
  if (out && faults.list.empty() && !failed) return {};
  std::error_code ignored;
  std::filesystem::remove(tried, ignored);
  if (!faults.list.empty()) return Error{ErrorCode::InvalidArgument, to_text(faults)};
  return cannot(file, failed);
}

}  // namespace

Status add_subject(const std::filesystem::path& configuration, const NewSubject& subject,
                   const std::function<Faults(const std::filesystem::path&)>& faults_of) {
  std::error_code failed;
  const std::filesystem::path file =
      std::filesystem::canonical(configuration, failed);  // the file itself, if `configuration` is a link
  if (failed) return cannot(configuration, failed);
  std::filesystem::path tried = file;
  tried += ".new";
  std::filesystem::copy_file(file, tried, std::filesystem::copy_options::overwrite_existing, failed);
  if (failed) return cannot(tried, failed);
  return append_and_replace(tried, text_of(subject), file, faults_of);
}

Status add_subject_to_state(const std::filesystem::path& added_subjects, const NewSubject& subject,
                            const std::function<Faults(const std::filesystem::path&)>& faults_of) {
  std::error_code failed;
  if (std::filesystem::exists(added_subjects, failed)) return add_subject(added_subjects, subject, faults_of);
  std::filesystem::path tried = added_subjects;
  tried += ".new";
  std::filesystem::remove(tried, failed);  // of a daemon that was killed
  const std::string text =
      "# Written by mocapd (mocapctl subject add). Read after the configuration; delete a table to remove its "
      "subject.\n";
  return append_and_replace(tried, text + text_of(subject), added_subjects, faults_of);
}

Result<std::filesystem::path> write_marker_set_text(const std::filesystem::path& folder, const std::string& name,
                                                    const std::string& text) {
  MOCAP_EXPECTS(is_file_name(name));
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return cannot(folder, failed);
  const std::filesystem::path in = std::filesystem::absolute(folder, failed);
  std::filesystem::path file = in / (name + ".toml");
  for (int i = 2; std::filesystem::exists(file, failed); ++i) file = in / fmt::format("{}-{}.toml", name, i);
  if (Status written = replace_file(file, text); !written) return written.error();
  return file;
}

}  // namespace mocap::settings
