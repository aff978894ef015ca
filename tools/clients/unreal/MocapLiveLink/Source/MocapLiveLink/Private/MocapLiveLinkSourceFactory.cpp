#include "MocapLiveLinkSourceFactory.h"

#include "MocapLiveLinkSource.h"
#include "MocapSettings.h"
#include "SMocapPanel.h"

FText UMocapLiveLinkSourceFactory::GetSourceTooltip() const {
  return FText::FromString(TEXT("People and props from the feed of a mocapd"));
}

TSharedPtr<SWidget> UMocapLiveLinkSourceFactory::BuildCreationPanel(
    FOnLiveLinkSourceCreated OnLiveLinkSourceCreated) const {
  return SNew(SMocapPanel).OnCreated(OnLiveLinkSourceCreated);
}

TSharedPtr<ILiveLinkSource> UMocapLiveLinkSourceFactory::CreateSource(const FString& ConnectionString) const {
  return MakeShared<FMocapLiveLinkSource>(FMocapSettings::FromString(ConnectionString));
}
