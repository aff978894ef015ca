#include "SMocapPanel.h"

#include "MocapLiveLinkSource.h"
#include "Widgets/Input/SButton.h"
#include "Widgets/Input/SCheckBox.h"
#include "Widgets/Input/SEditableTextBox.h"
#include "Widgets/Layout/SBox.h"
#include "Widgets/SBoxPanel.h"
#include "Widgets/Text/STextBlock.h"

namespace {

constexpr float kWidth = 340.0f;
constexpr float kLabelWidth = 90.0f;
constexpr float kPadding = 3.0f;

FText Text(const TCHAR* From) { return FText::FromString(From); }

}  // namespace

// clang-format off
void SMocapPanel::Construct(const FArguments& InArgs) {
  OnCreated = InArgs._OnCreated;
  ChildSlot[
    SNew(SBox).WidthOverride(kWidth)[
      SNew(SVerticalBox)
      + SVerticalBox::Slot().AutoHeight()[
          Row(TEXT("Address"), TEXT("HOST or HOST:PORT of the daemon's feed; the port is 5570 unless given"),
              SAssignNew(Address, SEditableTextBox).Text(Text(TEXT("127.0.0.1"))))
        ]
      + SVerticalBox::Slot().AutoHeight()[
          Row(TEXT("Server key"), TEXT("The daemon's public key, or a file with that key; empty: no encryption"),
              SAssignNew(ServerKey, SEditableTextBox).HintText(Text(TEXT("none"))))
        ]
      + SVerticalBox::Slot().AutoHeight()[
          Row(TEXT("Secret key"), TEXT("A file that `mocapctl keys new` has written"),
              SAssignNew(SecretKey, SEditableTextBox).HintText(Text(TEXT("none"))))
        ]
      + SVerticalBox::Slot().AutoHeight()[
          Row(TEXT("Axes"), TEXT("On for poses in the space of a mesh, which faces +Y as the Mannequin does. Off: +X, as actors do"),
              SAssignNew(MeshAxes, SCheckBox)[SNew(STextBlock).Text(Text(TEXT("subjects face +Y (mesh)")))])
        ]
      + SVerticalBox::Slot().AutoHeight().Padding(kPadding)[
          SAssignNew(Fault, STextBlock).AutoWrapText(true)
        ]
      + SVerticalBox::Slot().AutoHeight().Padding(kPadding)[
          SNew(SButton).OnClicked(this, &SMocapPanel::OnConnect)[SNew(STextBlock).Text(Text(TEXT("Connect")))]
        ]
    ]
  ];
}

TSharedRef<SWidget> SMocapPanel::Row(const TCHAR* Label, const TCHAR* Tooltip, TSharedRef<SWidget> Field) const {
  return SNew(SHorizontalBox)
    .ToolTipText(Text(Tooltip))
    + SHorizontalBox::Slot().AutoWidth().Padding(kPadding)[
        SNew(SBox).WidthOverride(kLabelWidth)[SNew(STextBlock).Text(Text(Label))]
      ]
    + SHorizontalBox::Slot().FillWidth(1.0f).Padding(kPadding)[Field];
}
// clang-format on

FMocapSettings SMocapPanel::Settings() const {
  FMocapSettings Made;
  Made.Address = Address->GetText().ToString().TrimStartAndEnd();
  Made.ServerKey = ServerKey->GetText().ToString().TrimStartAndEnd();
  Made.SecretKey = SecretKey->GetText().ToString().TrimStartAndEnd();
  Made.bMeshAxes = MeshAxes->IsChecked();
  return Made;
}

FReply SMocapPanel::OnConnect() {
  const FMocapSettings Chosen = Settings();
  if (!Chosen.Fault().IsEmpty()) {
    Fault->SetText(FText::FromString(Chosen.Fault()));
    return FReply::Handled();
  }
  const TSharedRef<FMocapLiveLinkSource> Source = MakeShared<FMocapLiveLinkSource>(Chosen);
  if (Source->IsSourceStillValid()) {
    OnCreated.ExecuteIfBound(Source, Chosen.ToString());
  } else {
    Fault->SetText(Source->GetSourceStatus());
  }
  return FReply::Handled();
}
