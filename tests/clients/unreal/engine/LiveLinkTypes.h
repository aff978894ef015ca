#pragma once

#include <cstdlib>

#include "CoreMinimal.h"
#include "Misc/QualifiedFrameTime.h"

struct FLiveLinkSubjectName {
  FLiveLinkSubjectName() = default;
  FLiveLinkSubjectName(FName name) : Name(std::move(name)) {}
  FName Name;
};
struct FLiveLinkSubjectKey {
  FLiveLinkSubjectKey(FGuid source, FName name) : Source(source), SubjectName(std::move(name)) {}
  FGuid Source;
  FLiveLinkSubjectName SubjectName;
};

class FLiveLinkWorldTime {
 public:
  FLiveLinkWorldTime() = default;
  FLiveLinkWorldTime(double time, double offset) : time_(time), offset_(offset) {}
  double GetSourceTime() const { return time_; }
  double GetOffsettedTime() const { return time_ + offset_; }

 private:
  double time_ = 0.0;
  double offset_ = 0.0;
};

struct FLiveLinkMetaData {
  std::map<std::string, FString> StringMetaData;
  FQualifiedFrameTime SceneTime;
};
struct FLiveLinkBaseStaticData {
  static UScriptStruct* StaticStruct() { return StandIn::TypeOf<FLiveLinkBaseStaticData>(); }
  TArray<FName> PropertyNames;
};
struct FLiveLinkBaseFrameData {
  static UScriptStruct* StaticStruct() { return StandIn::TypeOf<FLiveLinkBaseFrameData>(); }
  FLiveLinkWorldTime WorldTime;
  FLiveLinkMetaData MetaData;
  TArray<float> PropertyValues;
};

// Holds one struct of a type that is known at run time. A cast to another type is an error, as in the engine.
class LiveLinkStruct {
 public:
  explicit LiveLinkStruct(const UScriptStruct* type) : type_(type), held_(type->Create()) {}
  template <class T>
  T* Cast() {
    if (type_ != T::StaticStruct()) std::abort();
    return static_cast<T*>(held_.get());
  }
  const UScriptStruct* GetStruct() const { return type_; }

 private:
  const UScriptStruct* type_;
  std::shared_ptr<void> held_;
};
class FLiveLinkStaticDataStruct : public LiveLinkStruct {
  using LiveLinkStruct::LiveLinkStruct;
};
class FLiveLinkFrameDataStruct : public LiveLinkStruct {
  using LiveLinkStruct::LiveLinkStruct;
};
