#pragma once

#include "Widgets/DeclarativeSyntaxSupport.h"

class SCompoundWidget : public SWidget {
 protected:
  struct FChildSlot {
    SWidget* owner;
    void operator[](const TSharedRef<SWidget>& child) { owner->Children.push_back(child.held); }
  };
  FChildSlot ChildSlot{this};
};
