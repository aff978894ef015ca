#pragma once

#include "LiveLinkRole.h"

class ULiveLinkTransformRole : public ULiveLinkRole {
 public:
  static UClass* StaticClass() { return StandIn::ClassOf<ULiveLinkTransformRole>("Transform"); }
};
