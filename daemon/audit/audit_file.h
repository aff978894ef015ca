#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "audit/audit_settings.h"
#include "module/audit_writer.h"

namespace mocap::audit {

/// The file of the audit log: append only, mode 0640. A file over its limit is renamed (FILE.1 is the newest of the
/// older ones). A file that was moved away or removed is made anew.
class AuditFile final : public AuditWriter {
 public:
  /// Opens nothing. `max_bytes` of one file; `keep` older ones.
  AuditFile(std::filesystem::path path, std::uint64_t max_bytes, std::uint32_t keep);
  ~AuditFile() override;
  AuditFile(const AuditFile&) = delete;
  AuditFile& operator=(const AuditFile&) = delete;

  /// Fails with Io if the file is a symbolic link or no regular file, or cannot be written. A line that was written in
  /// part is removed again.
  Status append(const AuditEntry& entry) override;
  Status sync() override;

 private:
  Status open();
  void close() noexcept;
  bool is_at_its_path() const;
  Status finish_last_line();
  Status write(const std::string& text);
  Status rotate();

  std::filesystem::path path_;
  std::uint64_t max_bytes_;
  std::uint32_t keep_;
  int file_ = -1;
  std::uint64_t size_bytes_ = 0;
};

/// Null if the settings want no log.
std::unique_ptr<AuditWriter> make_audit_writer(const AuditSettings& settings);

}  // namespace mocap::audit
