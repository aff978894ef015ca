#pragma once

#include "Widgets/DeclarativeSyntaxSupport.h"

class SEditableTextBox : public SWidget {
 public:
  SLATE_BEGIN_ARGS(SEditableTextBox) {}
  SLATE_ARGUMENT(FText, Text)
  SLATE_ARGUMENT(FText, HintText)
  SLATE_END_ARGS()
  void Construct(const FArguments& arguments) { text_ = arguments._Text; }
  const char* Kind() const override { return "field"; }
  void SetText(const FText& text) { text_ = text; }
  FText GetText() const { return text_; }

 private:
  FText text_;
};
