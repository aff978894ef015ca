#pragma once

#include "Widgets/DeclarativeSyntaxSupport.h"

class STextBlock : public SWidget {
 public:
  SLATE_BEGIN_ARGS(STextBlock) {}
  SLATE_ARGUMENT(FText, Text)
  SLATE_ARGUMENT(bool, AutoWrapText)
  SLATE_END_ARGS()
  void Construct(const FArguments& arguments) { text_ = arguments._Text; }
  const char* Kind() const override { return "text"; }
  void SetText(const FText& text) { text_ = text; }
  const FText& GetText() const { return text_; }

 private:
  FText text_;
};
