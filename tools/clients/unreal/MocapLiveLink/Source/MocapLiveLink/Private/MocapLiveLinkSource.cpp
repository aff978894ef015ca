#include "MocapLiveLinkSource.h"

#include "HAL/PlatformTime.h"
#include "HAL/RunnableThread.h"
#include "ILiveLinkClient.h"
#include "LiveLinkTypes.h"
#include "MocapLibrary.h"
#include "MocapSceneClock.h"
#include "Roles/LiveLinkAnimationRole.h"
#include "Roles/LiveLinkAnimationTypes.h"
#include "Roles/LiveLinkTransformRole.h"
#include "Roles/LiveLinkTransformTypes.h"

// The times of all subjects of one frame.
struct FMocapLiveLinkSource::FTimes {
  FLiveLinkWorldTime World;
  FQualifiedFrameTime Scene;

  void Stamp(FLiveLinkBaseFrameData& Data) const {
    Data.WorldTime = World;
    Data.MetaData.SceneTime = Scene;
  }
};

namespace {

constexpr int32 kPatience_ms = 100;

// From an actor's axes (x forward) to those of its mesh (y forward): 90 degrees about z.
const FQuat kMeshFromActor(0.0, 0.0, 0.70710678118654752, 0.70710678118654752);

FName BoneName(const mocap_bone& Bone) {
  return FName(UTF8_TO_TCHAR(*Bone.unreal_name != '\0' ? Bone.unreal_name : Bone.name));
}

FName NameOf(const mocap_subject& Subject) { return FName(UTF8_TO_TCHAR(Subject.name)); }

bool IsProp(const mocap_subject& Subject) { return Subject.bone_count == 1; }

// The time of the exposure on the engine's clock. The second argument is an offset that the engine adds.
FLiveLinkWorldTime WorldTimeOf(int64 AgeNs) {
  const double Age_s = AgeNs == MOCAP_ABSENT ? 0.0 : static_cast<double>(AgeNs) * 1e-9;
  return FLiveLinkWorldTime(FPlatformTime::Seconds() - Age_s, 0.0);
}

const char* OrNull(const FTCHARToUTF8& Text) { return *Text.Get() != '\0' ? Text.Get() : nullptr; }

}  // namespace

FMocapLiveLinkSource::FMocapLiveLinkSource(const FMocapSettings& InSettings) : Settings(InSettings) {
  Fault = FMocapLibrary::Get().Fault;
  if (Fault.IsEmpty()) Open();
  if (Client == nullptr) UE_LOG(LogTemp, Error, TEXT("mocapd: %s"), *Fault);
}

FMocapLiveLinkSource::~FMocapLiveLinkSource() { End(); }

void FMocapLiveLinkSource::Open() {
  const FMocapLibrary& Library = FMocapLibrary::Get();
  const FTCHARToUTF8 Endpoint(*Settings.Endpoint());
  const FTCHARToUTF8 ServerKey(*Settings.ServerKey);
  const FTCHARToUTF8 SecretKey(*Settings.SecretKey);
  const FTCHARToUTF8 PublicKey(*Settings.PublicKey);
  mocap_client_options Options;
  Library.OptionsInit(&Options, sizeof Options);
  Options.endpoint = Endpoint.Get();
  Options.axes = MOCAP_AXES_UNREAL;
  Options.server_key = OrNull(ServerKey);
  Options.secret_key = OrNull(SecretKey);
  Options.public_key = OrNull(PublicKey);
  char Reason[256] = {};
  Client = Library.Open(&Options, Reason, sizeof Reason);
  if (Client == nullptr) Fault = UTF8_TO_TCHAR(Reason);
}

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
  if (Client == nullptr) return;
  FMocapLibrary::Get().Close(Client);
  Client = nullptr;
  Fault = TEXT("closed");
}

FText FMocapLiveLinkSource::GetSourceStatus() const {
  if (Client == nullptr) return FText::FromString(Fault);
  char Sentence[512] = {};
  FMocapLibrary::Get().Diagnose(Client, Sentence, sizeof Sentence);
  return FText::FromString(UTF8_TO_TCHAR(Sentence));
}

uint32 FMocapLiveLinkSource::Run() {
  const FMocapLibrary& Library = FMocapLibrary::Get();
  FMocapSceneClock Clock;
  mocap_frame* Frame = Library.FrameNew();
  while (!bStopping) {
    if (Library.Wait(Client, Frame, kPatience_ms) == 1) Push(Frame, Clock);
  }
  Library.FrameFree(Frame);
  return 0;
}

void FMocapLiveLinkSource::Push(const mocap_frame* Frame, FMocapSceneClock& Clock) {
  const FMocapLibrary& Library = FMocapLibrary::Get();
  mocap_frame_info Info;
  Library.GetInfo(Frame, &Info, sizeof Info);
  if (IsDescribedAnew(Frame, Info.description_version)) RemoveMissing(Frame);
  const FTimes Times{WorldTimeOf(Library.AgeNs(Frame)), Clock.At(Info, Library.NominalRateHz(Frame))};
  mocap_subject Subject;
  for (size_t i = 0; Library.GetSubject(Frame, i, &Subject, sizeof Subject) == 1; ++i) {
    const FName Name = NameOf(Subject);
    if (!Described.Contains(Name)) {
      Described.Add(Name);
      IsProp(Subject) ? PushProp(Name) : PushSkeleton(Subject, Name);
    }
    // The pose of a lost bone has no meaning. Without a root, the engine keeps the last pose.
    if (Subject.bone_pose_count == 0 || Subject.bone_poses[0].state == MOCAP_STATE_LOST) continue;
    IsProp(Subject) ? PushPropPose(Subject, Name, Times) : PushSkeletonPose(Subject, Name, Times);
  }
}

bool FMocapLiveLinkSource::IsDescribedAnew(const mocap_frame* Frame, uint32 Version) {
  const FString Now = UTF8_TO_TCHAR(FMocapLibrary::Get().Session(Frame));
  const bool bAnew = Now != Session || Version != DescriptionVersion;
  Session = Now;
  DescriptionVersion = Version;
  return bAnew;
}

// Forgets what was described before, and removes the subjects that the feed no longer has.
void FMocapLiveLinkSource::RemoveMissing(const mocap_frame* Frame) {
  TArray<FName> Present;
  mocap_subject Subject;
  for (size_t i = 0; FMocapLibrary::Get().GetSubject(Frame, i, &Subject, sizeof Subject) == 1; ++i)
    Present.Add(NameOf(Subject));
  for (const FName& Name : Described) {
    if (!Present.Contains(Name)) LiveLink->RemoveSubject_AnyThread(FLiveLinkSubjectKey(SourceGuid, Name));
  }
  Described.Empty();
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
  LiveLink->PushSubjectStaticData_AnyThread(FLiveLinkSubjectKey(SourceGuid, Name),
                                            ULiveLinkAnimationRole::StaticClass(), MoveTemp(Data));
}

void FMocapLiveLinkSource::PushProp(FName Name) {
  FLiveLinkStaticDataStruct Data(FLiveLinkTransformStaticData::StaticStruct());
  FLiveLinkTransformStaticData& Prop = *Data.Cast<FLiveLinkTransformStaticData>();
  Prop.bIsLocationSupported = true;
  Prop.bIsRotationSupported = true;
  Prop.bIsScaleSupported = false;
  LiveLink->PushSubjectStaticData_AnyThread(FLiveLinkSubjectKey(SourceGuid, Name),
                                            ULiveLinkTransformRole::StaticClass(), MoveTemp(Data));
}

void FMocapLiveLinkSource::PushSkeletonPose(const mocap_subject& Subject, FName Name, const FTimes& Times) {
  FLiveLinkFrameDataStruct Data(FLiveLinkAnimationFrameData::StaticStruct());
  FLiveLinkAnimationFrameData& Pose = *Data.Cast<FLiveLinkAnimationFrameData>();
  Times.Stamp(Pose);
  for (size_t i = 0; i < Subject.bone_pose_count; ++i) Pose.Transforms.Add(Local(Subject, static_cast<int32>(i)));
  LiveLink->PushSubjectFrameData_AnyThread(FLiveLinkSubjectKey(SourceGuid, Name), MoveTemp(Data));
}

void FMocapLiveLinkSource::PushPropPose(const mocap_subject& Subject, FName Name, const FTimes& Times) {
  FLiveLinkFrameDataStruct Data(FLiveLinkTransformFrameData::StaticStruct());
  FLiveLinkTransformFrameData& Pose = *Data.Cast<FLiveLinkTransformFrameData>();
  Times.Stamp(Pose);
  Pose.Transform = Local(Subject, 0);
  LiveLink->PushSubjectFrameData_AnyThread(FLiveLinkSubjectKey(SourceGuid, Name), MoveTemp(Data));
}

// A lost bone is in rest pose relative to its parent. In rest pose the axes of all bones are parallel to the world's,
// so one rotation converts every bone.
FTransform FMocapLiveLinkSource::Local(const mocap_subject& Subject, int32 Bone) const {
  const mocap_bone_pose& Pose = Subject.bone_poses[Bone];
  const bool bLost = Pose.state == MOCAP_STATE_LOST;
  const mocap_vec3 P = bLost ? Subject.bones[Bone].rest_offset : Pose.local_position;
  const mocap_quat Q = bLost ? mocap_quat{0.0F, 0.0F, 0.0F, 1.0F} : Pose.local_rotation;
  const FVector Place(P.x, P.y, P.z);
  const FQuat Turn(Q.x, Q.y, Q.z, Q.w);
  if (!Settings.bMeshAxes) return FTransform(Turn, Place);
  return FTransform(kMeshFromActor * Turn * kMeshFromActor.Inverse(), kMeshFromActor.RotateVector(Place));
}
