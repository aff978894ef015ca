#pragma once

#include "LiveLinkTypes.h"

struct FLiveLinkTransformStaticData : FLiveLinkBaseStaticData {
  static UScriptStruct* StaticStruct() { return StandIn::TypeOf<FLiveLinkTransformStaticData>(); }
  bool bIsLocationSupported = true;
  bool bIsRotationSupported = true;
  bool bIsScaleSupported = false;
};
struct FLiveLinkTransformFrameData : FLiveLinkBaseFrameData {
  static UScriptStruct* StaticStruct() { return StandIn::TypeOf<FLiveLinkTransformFrameData>(); }
  FTransform Transform;
};
