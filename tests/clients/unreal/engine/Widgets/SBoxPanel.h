#pragma once

#include "Widgets/DeclarativeSyntaxSupport.h"

namespace StandIn {
struct Slot {
  Slot& AutoHeight() { return *this; }
  Slot& AutoWidth() { return *this; }
  Slot& FillWidth(float) { return *this; }
  Slot& FillHeight(float) { return *this; }
  Slot& Padding(float) { return *this; }
  Slot& operator[](const TSharedRef<SWidget>& content) {
    child = content.held;
    return *this;
  }
  std::shared_ptr<SWidget> child;
};
template <class Box>
class BoxPanel : public SWidget {
 public:
  SLATE_BEGIN_ARGS(Box) {}
  FArguments& operator+(const Slot& slot) {
    this->_Children.push_back(slot.child);
    return *this;
  }
  SLATE_END_ARGS()
  void Construct(const FArguments&) {}
  static StandIn::Slot Slot() { return {}; }
};
}  // namespace StandIn

class SVerticalBox : public StandIn::BoxPanel<SVerticalBox> {};
class SHorizontalBox : public StandIn::BoxPanel<SHorizontalBox> {};
