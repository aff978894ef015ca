#include "lib/retrack/made_of.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <string_view>

#include "lib/retrack/new_take.h"
#include "take/take_edit.h"

namespace mocap::retrack {
namespace {

constexpr std::size_t kPiece_bytes = 1024 * 1024;

// Changes if the same order shall no longer give the same digest.
constexpr std::string_view kFormat = "1";

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new()) { EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr); }

  void add_bytes(std::string_view bytes) { EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()); }

  // A text with its length, so that no two lists of texts give the same bytes.
  void add(std::string_view text) {
    add_bytes(fmt::format("{}:", text.size()));
    add_bytes(text);
  }

  std::string digits() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned size = 0;
    EVP_DigestFinal_ex(context_.get(), digest.data(), &size);
    std::string text;
    for (unsigned i = 0; i < size; ++i) text += fmt::format("{:02x}", digest[i]);
    return text;
  }

 private:
  struct Free {
    void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
  };
  std::unique_ptr<EVP_MD_CTX, Free> context_;
};

Result<std::string> digest_of_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::NotFound, fmt::format("'{}': {}", path.string(), std::strerror(errno))};
  Sha256 digest;
  std::string piece(kPiece_bytes, '\0');
  do {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    digest.add_bytes({piece.data(), static_cast<std::size_t>(file.gcount())});
  } while (file);
  if (file.bad()) return Error{ErrorCode::Io, fmt::format("'{}' cannot be read", path.string())};
  return digest.digits();
}

std::string text_of(const std::optional<Duration>& time) { return time ? fmt::format("{}", time->count()) : "none"; }

}  // namespace

Result<std::string> made_of(const RetrackOrder& order, const std::vector<TakeFile>& settings_files,
                            const std::string& producer) {
  const Result<std::string> take = digest_of_file(order.take);
  if (!take) return take.error();
  Sha256 all;
  for (const std::string_view text : {kFormat, std::string_view(producer), std::string_view(*take)}) all.add(text);
  for (const std::string& text : {text_of(order.from), text_of(order.to)}) all.add(text);
  all.add(order.offline ? "offline" : "live");
  all.add(order.every_set ? "every set" : "recorded sets");
  // A file that is given is not the recorded one, even if it has the same bytes: what was known about the bodies when
  // the take began is of the recorded one.
  const OtherFiles& others = order.others;
  for (const std::filesystem::path* file : {&others.settings, &others.rig, &others.subjects}) {
    all.add(file->empty() ? "recorded" : "given");
  }
  if (order.chunk) all.add(fmt::format("{} chunks, {} ns", order.chunk->of, order.chunk->overlap.count()));
  for (const TakeFile& file : settings_files) {
    all.add(file.name);
    all.add(file.bytes);
  }
  return all.digits();
}

Status check_made_of(const std::filesystem::path& path, const std::string& digest) {
  const Result<take::TakeReader> take = take::TakeReader::open(path);
  if (!take) return take.error();
  const auto known = take->info().others.find(kMadeOf);
  if (take->is_whole() && known != take->info().others.end() && known->second == digest) {
    const auto faults = take::verify_take(path);
    if (!faults) return faults.error();
    if (faults->empty()) return {};
  }
  return Error{
      ErrorCode::InvalidArgument,
      fmt::format("'{}' exists, but is damaged, was repaired, or was made of another take, with other settings "
                  "or by another version; it is kept: move it away or choose another name",
                  path.string())};
}

}  // namespace mocap::retrack
