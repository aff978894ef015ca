#include "MocapLiveLinkSource.h"

#include "HAL/PlatformTime.h"
#include "HAL/RunnableThread.h"
#include "ILiveLinkClient.h"
#include "Modules/ModuleManager.h"
#include "Roles/LiveLinkAnimationRole.h"
#include "Roles/LiveLinkAnimationTypes.h"
#include "mocap_client.h"

IMPLEMENT_MODULE(FDefaultModuleImpl, MocapLiveLink)

namespace {

constexpr int32 kPatience_ms = 100;

FVector Place(mocap_vec3 V) { return FVector(V.x, V.y, V.z); }
FQuat Turn(mocap_quat Q) { return FQuat(Q.x, Q.y, Q.z, Q.w); }

FName BoneName(const mocap_bone& Bone) {
  return FName(UTF8_TO_TCHAR(*Bone.unreal_name != '\0' ? Bone.unreal_name : Bone.name));
}

}  // namespace

FMocapLiveLinkSource::FMocapLiveLinkSource(const FString& InEndpoint) : Endpoint(InEndpoint) {
  const FTCHARToUTF8 Utf8(*Endpoint);
  mocap_client_options Options;
  mocap_client_options_init(&Options, sizeof Options);
  if (!Endpoint.IsEmpty()) Options.endpoint = Utf8.Get();
  Options.axes = MOCAP_AXES_UNREAL;
  char Fault[256] = {};
  Client = mocap_client_open(&Options, Fault, sizeof Fault);
  if (Client == nullptr) UE_LOG(LogTemp, Error, TEXT("mocapd: %s"), UTF8_TO_TCHAR(Fault));
}

FMocapLiveLinkSource::~FMocapLiveLinkSource() { End(); }

void FMocapLiveLinkSource::ReceiveClient(ILiveLinkClient* InClient, FGuid InSourceGuid) {
  LiveLink = InClient;
  SourceGuid = InSourceGuid;
  if (Client != nullptr) Thread = FRunnableThread::Create(this, TEXT("MocapLiveLink"));
}

bool FMocapLiveLinkSource::RequestSourceShutdown() {
  End();
  return true;
}

void FMocapLiveLinkSource::End() {
  if (Thread != nullptr) Thread->Kill(true);
  delete Thread;
  Thread = nullptr;
  mocap_client_close(Client);
  Client = nullptr;
}

FText FMocapLiveLinkSource::GetSourceStatus() const {
  if (Client == nullptr) return FText::FromString(TEXT("not connected"));
  char Sentence[512] = {};
  mocap_client_diagnose(Client, Sentence, sizeof Sentence);
  return FText::FromString(UTF8_TO_TCHAR(Sentence));
}

uint32 FMocapLiveLinkSource::Run() {
  mocap_frame* Frame = mocap_frame_new();
  while (!bStopping) {
    if (mocap_client_wait(Client, Frame, kPatience_ms) == 1) Push(Frame);
  }
  mocap_frame_free(Frame);
  return 0;
}

void FMocapLiveLinkSource::Push(const mocap_frame* Frame) {
  mocap_frame_info Info;
  mocap_frame_get_info(Frame, &Info, sizeof Info);
  const FString Now = UTF8_TO_TCHAR(mocap_frame_session(Frame));
  const bool bDescribedAnew = Now != Session || Info.description_version != DescriptionVersion;
  Session = Now;
  DescriptionVersion = Info.description_version;
  mocap_subject Subject;
  for (size_t i = 0; mocap_frame_get_subject(Frame, i, &Subject, sizeof Subject) == 1; ++i) {
    const FName Name(UTF8_TO_TCHAR(Subject.name));
    if (bDescribedAnew) PushSkeleton(Subject, Name);
    if (Subject.bone_pose_count > 0) PushPose(Subject, Name, mocap_frame_age_ns(Frame));
  }
}

void FMocapLiveLinkSource::PushSkeleton(const mocap_subject& Subject, FName Name) {
  FLiveLinkStaticDataStruct Data(FLiveLinkSkeletonStaticData::StaticStruct());
  FLiveLinkSkeletonStaticData& Skeleton = *Data.Cast<FLiveLinkSkeletonStaticData>();
  TArray<FName> Names;
  TArray<int32> Parents;
  for (size_t i = 0; i < Subject.bone_count; ++i) {
    Names.Add(BoneName(Subject.bones[i]));
    Parents.Add(Subject.bones[i].parent);
  }
  Skeleton.SetBoneNames(Names);
  Skeleton.SetBoneParents(Parents);
  LiveLink->PushSubjectStaticData_AnyThread({SourceGuid, Name}, ULiveLinkAnimationRole::StaticClass(), MoveTemp(Data));
}

void FMocapLiveLinkSource::PushPose(const mocap_subject& Subject, FName Name, int64 AgeNs) {
  FLiveLinkFrameDataStruct Data(FLiveLinkAnimationFrameData::StaticStruct());
  FLiveLinkAnimationFrameData& Pose = *Data.Cast<FLiveLinkAnimationFrameData>();
  // The exposure on the engine's clock.
  const double Age_s = AgeNs == MOCAP_ABSENT ? 0.0 : static_cast<double>(AgeNs) * 1e-9;
  Pose.WorldTime = FLiveLinkWorldTime(FPlatformTime::Seconds() - Age_s);
  for (size_t i = 0; i < Subject.bone_pose_count; ++i) {
    const mocap_bone_pose& Bone = Subject.bone_poses[i];
    Pose.Transforms.Add(FTransform(Turn(Bone.local_rotation), Place(Bone.local_position)));
  }
  LiveLink->PushSubjectFrameData_AnyThread({SourceGuid, Name}, MoveTemp(Data));
}

TSharedPtr<ILiveLinkSource> UMocapLiveLinkSourceFactory::CreateSource(const FString& ConnectionString) const {
  return MakeShared<FMocapLiveLinkSource>(ConnectionString);
}
