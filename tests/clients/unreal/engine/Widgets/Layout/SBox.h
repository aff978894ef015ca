#pragma once

#include "Widgets/DeclarativeSyntaxSupport.h"

class SBox : public SWidget {
 public:
  SLATE_BEGIN_ARGS(SBox) {}
  SLATE_ARGUMENT(float, WidthOverride)
  SLATE_END_ARGS()
  void Construct(const FArguments&) {}
};
