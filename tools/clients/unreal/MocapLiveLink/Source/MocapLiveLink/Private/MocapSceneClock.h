#pragma once

#include "CoreMinimal.h"
#include "Misc/QualifiedFrameTime.h"
#include "mocap_client.h"

// The scene time (timecode) of frames. Call from one thread, with frames in order.
class FMocapSceneClock {
 public:
  FMocapSceneClock();

  // The SMPTE timecode of the daemon. Without one: the local time of day of the exposure, counted at the nominal rate
  // of the feed, as the engine's provider "System Time" does. The default value if the time is unknown.
  FQualifiedFrameTime At(const mocap_frame_info& Info, double NominalRateHz);

 private:
  FQualifiedFrameTime FromTimecode(const mocap_frame_info& Info);

  double LocalMinusUtc_s;
  FFrameNumber Counted;                  // the timecode of the last frame
  int64 CountedSince_ns = MOCAP_ABSENT;  // exposure of the first frame with this timecode
};
