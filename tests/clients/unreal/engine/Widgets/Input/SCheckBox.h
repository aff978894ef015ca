#pragma once

#include "Widgets/DeclarativeSyntaxSupport.h"

class SCheckBox : public SWidget {
 public:
  SLATE_BEGIN_ARGS(SCheckBox) {}
  SLATE_END_ARGS()
  void Construct(const FArguments&) {}
  const char* Kind() const override { return "check"; }
  void ToggleCheckedState() { checked_ = !checked_; }
  bool IsChecked() const { return checked_; }

 private:
  bool checked_ = false;
};
