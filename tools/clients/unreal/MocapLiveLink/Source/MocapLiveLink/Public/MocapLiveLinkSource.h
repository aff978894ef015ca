#pragma once

#include "CoreMinimal.h"
#include "HAL/Runnable.h"
#include "ILiveLinkSource.h"
#include "LiveLinkSourceFactory.h"

#include "MocapLiveLinkSource.generated.h"

struct mocap_client;
struct mocap_frame;
struct mocap_subject;

// Each subject of a mocapd's feed as a Live Link subject. One thread waits for frames and pushes them.
class MOCAPLIVELINK_API FMocapLiveLinkSource : public ILiveLinkSource, public FRunnable {
 public:
  explicit FMocapLiveLinkSource(const FString& InEndpoint);
  virtual ~FMocapLiveLinkSource() override;

  // ILiveLinkSource
  virtual void ReceiveClient(ILiveLinkClient* InClient, FGuid InSourceGuid) override;
  virtual bool IsSourceStillValid() const override { return Client != nullptr; }
  virtual bool RequestSourceShutdown() override;
  virtual FText GetSourceType() const override { return FText::FromString(TEXT("mocapd")); }
  virtual FText GetSourceMachineName() const override { return FText::FromString(Endpoint); }
  virtual FText GetSourceStatus() const override;

  // FRunnable
  virtual uint32 Run() override;
  virtual void Stop() override { bStopping = true; }

 private:
  void Push(const mocap_frame* Frame);
  void PushSkeleton(const mocap_subject& Subject, FName Name);
  void PushPose(const mocap_subject& Subject, FName Name, int64 AgeNs);
  void End();

  FString Endpoint;
  mocap_client* Client = nullptr;
  ILiveLinkClient* LiveLink = nullptr;
  FGuid SourceGuid;
  FRunnableThread* Thread = nullptr;
  TAtomic<bool> bStopping{false};
  FString Session;
  uint32 DescriptionVersion = 0;
};

// "mocapd" in Live Link's list of sources; the connection string is the endpoint.
UCLASS()
class MOCAPLIVELINK_API UMocapLiveLinkSourceFactory : public ULiveLinkSourceFactory {
  GENERATED_BODY()

 public:
  virtual FText GetSourceDisplayName() const override { return FText::FromString(TEXT("mocapd")); }
  virtual FText GetSourceTooltip() const override { return FText::FromString(TEXT("The feed of a mocapd")); }
  virtual EMenuType GetMenuType() const override { return EMenuType::MenuEntry; }
  virtual TSharedPtr<ILiveLinkSource> CreateSource(const FString& ConnectionString) const override;
};
