#pragma once

#include "Input/Reply.h"
#include "Widgets/DeclarativeSyntaxSupport.h"

using FOnClicked = TDelegate<FReply()>;

class SButton : public SWidget {
 public:
  SLATE_BEGIN_ARGS(SButton) {}
  SLATE_EVENT(FOnClicked, OnClicked)
  SLATE_END_ARGS()
  void Construct(const FArguments& arguments) { on_clicked_ = arguments._OnClicked; }
  const char* Kind() const override { return "button"; }
  // As the user's mouse does.
  FReply Click() { return on_clicked_.Execute(); }

 private:
  FOnClicked on_clicked_;
};
