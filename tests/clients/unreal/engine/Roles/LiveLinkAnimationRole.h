#pragma once

#include "LiveLinkRole.h"

class ULiveLinkAnimationRole : public ULiveLinkRole {
 public:
  static UClass* StaticClass() { return StandIn::ClassOf<ULiveLinkAnimationRole>("Animation"); }
};
