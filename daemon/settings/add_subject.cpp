#include "settings/add_subject.h"

#include <fmt/format.h>

#include <fstream>
#include <system_error>

namespace mocap::settings {
namespace {

Error cannot(const std::filesystem::path& file, const std::error_code& why) {
  return {ErrorCode::Io,
          fmt::format("cannot write {}: {}; let the daemon's user write there, or add the [[subject]] by "
                      "hand and mocapctl reload",
                      file.string(), why ? why.message() : "the disk may be full")};
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
  std::ofstream out(tried, std::ios::app | std::ios::binary);
  out << fmt::format("\n[[subject]]\nname = \"{}\"\nmarker_set = \"{}\"\n", subject.name, subject.marker_set.string());
  out.close();
  const Faults faults = out ? faults_of(tried) : Faults{};
  if (out && faults.list.empty()) std::filesystem::rename(tried, file, failed);
  if (out && faults.list.empty() && !failed) return {};
  std::error_code ignored;
  std::filesystem::remove(tried, ignored);
  if (!faults.list.empty()) return Error{ErrorCode::InvalidArgument, to_text(faults)};
  return cannot(file, failed);
}

}  // namespace mocap::settings
