#pragma once

#include <cstdint>
#include <memory>

#include "module/audit_writer.h"

namespace mocap::audit {

/// Passes entries on, but of connections and refusals at most kBurst at once and kPerMinute in the long run, so that a
/// client that connects again and again cannot push the orders out of the log. What is left out is counted by an entry
/// "skipped". The clock is the time of the entries.
class LimitedWriter final : public AuditWriter {
 public:
  static constexpr double kBurst = 200.0;
  static constexpr double kPerMinute = 20.0;  // 7 MB a day of lines of 250 bytes

  explicit LimitedWriter(std::unique_ptr<AuditWriter> writer);

  Status append(const AuditEntry& entry) override;
  Status sync() override { return writer_->sync(); }

 private:
  bool admit(const AuditEntry& entry);
  Status tell_skipped(std::int64_t at_utc_ns);

  std::unique_ptr<AuditWriter> writer_;
  double tokens_ = kBurst;
  std::int64_t filled_at_ns_ = 0;
  std::uint64_t skipped_ = 0;
};

}  // namespace mocap::audit
