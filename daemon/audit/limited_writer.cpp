#include "audit/limited_writer.h"

#include <algorithm>
#include <string>
#include <utility>

namespace mocap::audit {
namespace {

constexpr double kMinute_ns = 60e9;

// A client without a key causes these.
bool is_limited(const AuditEntry& entry) {
  return entry.what == "connected" || entry.what == "disconnected" || entry.what == "refused";
}

}  // namespace

LimitedWriter::LimitedWriter(std::unique_ptr<AuditWriter> writer) : writer_(std::move(writer)) {}

Status LimitedWriter::append(const AuditEntry& entry) {
  if (!admit(entry)) {
    ++skipped_;
    return {};
  }
  if (skipped_ > 0) {
    if (Status told = tell_skipped(entry.at_utc_ns); !told) return told;
  }
  return writer_->append(entry);
}

// UTC may step back; the time then begins anew.
bool LimitedWriter::admit(const AuditEntry& entry) {
  if (!is_limited(entry)) return true;
  const auto passed_ns = static_cast<double>(std::max<std::int64_t>(entry.at_utc_ns - filled_at_ns_, 0));
  tokens_ = std::min(kBurst, tokens_ + kPerMinute * passed_ns / kMinute_ns);
  filled_at_ns_ = entry.at_utc_ns;
  if (tokens_ < 1.0) return false;
  tokens_ -= 1.0;
  return true;
}

Status LimitedWriter::tell_skipped(std::int64_t at_utc_ns) {
  AuditEntry entry{.what = "skipped", .details = {{"lines", std::to_string(skipped_)}}, .at_utc_ns = at_utc_ns};
  const Status told = writer_->append(entry);
  if (told) skipped_ = 0;
  return told;
}

}  // namespace mocap::audit
