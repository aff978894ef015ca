#include "MocapSceneClock.h"

#include "Misc/DateTime.h"
#include "Misc/Timecode.h"

namespace {

constexpr double kDay_s = 86400.0;
constexpr int64 kDay_ns = 86400LL * 1000 * 1000 * 1000;

// Drop-frame counting exists for multiples of 29.97 Hz.
FFrameRate RateOf(const mocap_frame_info& Info) {
  return Info.timecode_drop_frame != 0 ? FFrameRate(Info.timecode_rate * 1000, 1001)
                                       : FFrameRate(Info.timecode_rate, 1);
}

}  // namespace

FMocapSceneClock::FMocapSceneClock() {
  // Time zones differ from UTC by whole minutes; the two calls are not at the same instant.
  LocalMinusUtc_s = FMath::RoundToDouble((FDateTime::Now() - FDateTime::UtcNow()).GetTotalMinutes()) * 60.0;
}

FQualifiedFrameTime FMocapSceneClock::At(const mocap_frame_info& Info, double NominalRateHz) {
  if (Info.timecode_rate > 0) return FromTimecode(Info);
  if (Info.exposed_at_ns == MOCAP_ABSENT || Info.utc_minus_host_ns == MOCAP_ABSENT || NominalRateHz < 1.0) return {};
  const double Utc_s = static_cast<double>((Info.exposed_at_ns + Info.utc_minus_host_ns) % kDay_ns) * 1e-9;
  const FFrameRate Rate(static_cast<uint32>(FMath::RoundToDouble(NominalRateHz)), 1);
  return FQualifiedFrameTime(Rate.AsFrameTime(FMath::Fmod(Utc_s + LocalMinusUtc_s + kDay_s, kDay_s)), Rate);
}

// A feed is often faster than its timecode: the frames that share a timecode get rising fractions of it.
FQualifiedFrameTime FMocapSceneClock::FromTimecode(const mocap_frame_info& Info) {
  const FTimecode Timecode(Info.timecode_hours, Info.timecode_minutes, Info.timecode_seconds, Info.timecode_frames,
                           Info.timecode_drop_frame != 0);
  const FFrameRate Rate = RateOf(Info);
  const FFrameNumber Number = Timecode.ToFrameNumber(Rate);
  if (Number != Counted || CountedSince_ns == MOCAP_ABSENT) {
    Counted = Number;
    CountedSince_ns = Info.exposed_at_ns;
  }
  const bool bTimed = Info.exposed_at_ns != MOCAP_ABSENT && CountedSince_ns != MOCAP_ABSENT;
  const double Since_s = bTimed ? static_cast<double>(Info.exposed_at_ns - CountedSince_ns) * 1e-9 : 0.0;
  const double Fraction = FMath::Clamp(Since_s * Rate.AsDecimal(), 0.0, 0.999);
  return FQualifiedFrameTime(FFrameTime(Number, static_cast<float>(Fraction)), Rate);
}
