#pragma once

#include "CoreMinimal.h"

// A widget of the tests is a node of a tree with a kind and a text.
class SWidget {
 public:
  virtual ~SWidget() = default;
  virtual const char* Kind() const { return "widget"; }
  std::vector<std::shared_ptr<SWidget>> Children;
  FText ToolTip;
};
