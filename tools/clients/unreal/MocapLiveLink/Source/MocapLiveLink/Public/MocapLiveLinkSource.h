#pragma once

#include <atomic>

#include "CoreMinimal.h"
#include "HAL/Runnable.h"
#include "ILiveLinkSource.h"
#include "MocapSettings.h"

class FMocapSceneClock;
class FRunnableThread;
class ILiveLinkClient;
struct mocap_client;
struct mocap_frame;
struct mocap_subject;

// Provides each subject of a mocapd feed as a Live Link subject: a person with the Animation role, a prop (one bone)
// with the Transform role. One thread waits for frames and pushes them.
class MOCAPLIVELINK_API FMocapLiveLinkSource : public ILiveLinkSource, public FRunnable {
 public:
  explicit FMocapLiveLinkSource(const FMocapSettings& InSettings);
  ~FMocapLiveLinkSource() override;

  // ILiveLinkSource
  void ReceiveClient(ILiveLinkClient* InClient, FGuid InSourceGuid) override;
  bool IsSourceStillValid() const override { return Client != nullptr; }
  bool RequestSourceShutdown() override;
  FText GetSourceType() const override { return FText::FromString(TEXT("mocapd")); }
  FText GetSourceMachineName() const override { return FText::FromString(Settings.Endpoint()); }
  FText GetSourceStatus() const override;

  // FRunnable
  uint32 Run() override;
  void Stop() override { bStopping = true; }

 private:
  struct FTimes;

  void Open();
  void End();
  void Push(const mocap_frame* Frame, FMocapSceneClock& Clock);
  bool IsDescribedAnew(const mocap_frame* Frame, uint32 Version);
  void RemoveMissing(const mocap_frame* Frame);
  void PushSkeleton(const mocap_subject& Subject, FName Name);
  void PushProp(FName Name);
  void PushSkeletonPose(const mocap_subject& Subject, FName Name, const FTimes& Times);
  void PushPropPose(const mocap_subject& Subject, FName Name, const FTimes& Times);
  FTransform Local(const mocap_subject& Subject, int32 Bone) const;

  FMocapSettings Settings;
  FString Fault;  // the reason why Client is null
  mocap_client* Client = nullptr;
  ILiveLinkClient* LiveLink = nullptr;
  FGuid SourceGuid;
  FRunnableThread* Thread = nullptr;
  std::atomic<bool> bStopping{false};

  // Of the thread alone.
  FString Session;
  uint32 DescriptionVersion = 0;
  TArray<FName> Described;  // subjects whose static data was pushed
};
