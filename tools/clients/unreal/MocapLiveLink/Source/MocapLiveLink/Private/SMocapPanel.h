#pragma once

#include "CoreMinimal.h"
#include "Input/Reply.h"
#include "LiveLinkSourceFactory.h"
#include "MocapSettings.h"
#include "Widgets/DeclarativeSyntaxSupport.h"
#include "Widgets/SCompoundWidget.h"

class SCheckBox;
class SEditableTextBox;
class STextBlock;

// Asks for address, keys and axes, and creates the source. A fault is shown in the panel, and no source is added.
class SMocapPanel : public SCompoundWidget {
 public:
  SLATE_BEGIN_ARGS(SMocapPanel) {}
  SLATE_EVENT(ULiveLinkSourceFactory::FOnLiveLinkSourceCreated, OnCreated)
  SLATE_END_ARGS()

  void Construct(const FArguments& InArgs);

 private:
  TSharedRef<SWidget> Row(const TCHAR* Label, const TCHAR* Tooltip, TSharedRef<SWidget> Field) const;
  FReply OnConnect();
  FMocapSettings Settings() const;

  ULiveLinkSourceFactory::FOnLiveLinkSourceCreated OnCreated;
  TSharedPtr<SEditableTextBox> Address;
  TSharedPtr<SEditableTextBox> ServerKey;
  TSharedPtr<SEditableTextBox> SecretKey;
  TSharedPtr<SCheckBox> MeshAxes;
  TSharedPtr<STextBlock> Fault;
};
