#pragma once

#include "CoreMinimal.h"
#include "LiveLinkSourceFactory.h"

#include "MocapLiveLinkSourceFactory.generated.h"

// The entry "mocapd" in the list of Live Link sources: opens a panel with the settings.
UCLASS()
class MOCAPLIVELINK_API UMocapLiveLinkSourceFactory : public ULiveLinkSourceFactory {
  GENERATED_BODY()

 public:
  FText GetSourceDisplayName() const override { return FText::FromString(TEXT("mocapd")); }
  FText GetSourceTooltip() const override;
  EMenuType GetMenuType() const override { return EMenuType::SubPanel; }
  TSharedPtr<SWidget> BuildCreationPanel(FOnLiveLinkSourceCreated OnLiveLinkSourceCreated) const override;

  // For presets and Blueprints. The connection string is FMocapSettings::ToString, or an address alone.
  TSharedPtr<ILiveLinkSource> CreateSource(const FString& ConnectionString) const override;
};
