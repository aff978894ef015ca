// As much of Unreal Engine as the Live Link source uses, so that it is compiled and run where there is no engine. Every
// header of the engine that it includes comes to this file.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using int32 = std::int32_t;
using uint32 = std::uint32_t;
using int64 = std::int64_t;
using TCHAR = wchar_t;
template <class T>
using TAtomic = std::atomic<T>;
template <class T>
using TSharedPtr = std::shared_ptr<T>;

#define TEXT(text) L##text
#define UCLASS()
#define GENERATED_BODY()
#define MOCAPLIVELINK_API
#define IMPLEMENT_MODULE(implementation, name)
#define UE_LOG(category, level, format, ...) std::fprintf(stderr, "%ls\n", static_cast<const TCHAR*>(__VA_ARGS__))

// Names are ASCII here.
struct Utf8ToTchar {
  explicit Utf8ToTchar(const char* from) : text(from, from + std::char_traits<char>::length(from)) {}
  operator const TCHAR*() const { return text.c_str(); }
  std::wstring text;
};
#define UTF8_TO_TCHAR(text) static_cast<const TCHAR*>(Utf8ToTchar(text))

class FString {
 public:
  FString() = default;
  FString(const TCHAR* from) : text_(from) {}
  bool IsEmpty() const { return text_.empty(); }
  const TCHAR* operator*() const { return text_.c_str(); }
  bool operator!=(const FString& other) const { return text_ != other.text_; }

 private:
  std::wstring text_;
};

struct FTCHARToUTF8 {
  explicit FTCHARToUTF8(const TCHAR* from) {
    for (; *from != 0; ++from) text += static_cast<char>(*from);
  }
  const char* Get() const { return text.c_str(); }
  std::string text;
};

struct FText {
  static FText FromString(const FString& from) { return {from}; }
  FString text;
};

struct FName {
  FName() = default;
  explicit FName(const TCHAR* from) : text(FTCHARToUTF8(from).text) {}
  std::string text;
};

template <class T>
class TArray {
 public:
  void Add(T value) { values_.push_back(std::move(value)); }
  const std::vector<T>& Values() const { return values_; }

 private:
  std::vector<T> values_;
};

template <class T>
T&& MoveTemp(T& value) {
  return static_cast<T&&>(value);
}
template <class T, class... Arguments>
TSharedPtr<T> MakeShared(Arguments&&... arguments) {
  return std::make_shared<T>(std::forward<Arguments>(arguments)...);
}

struct FVector {
  FVector(double x, double y, double z) : X(x), Y(y), Z(z) {}
  double X, Y, Z;
};
struct FQuat {
  FQuat(double x, double y, double z, double w) : X(x), Y(y), Z(z), W(w) {}
  double X, Y, Z, W;
};
struct FTransform {
  FTransform(const FQuat& rotation, const FVector& translation) : Rotation(rotation), Translation(translation) {}
  FQuat Rotation;
  FVector Translation;
};
struct FGuid {};

struct FPlatformTime {
  static double Seconds() { return 1000.0; }
};

class FRunnable {
 public:
  virtual ~FRunnable() = default;
  virtual uint32 Run() = 0;
  virtual void Stop() {}
};

class FRunnableThread {
 public:
  static FRunnableThread* Create(FRunnable* runnable, const TCHAR*) { return new FRunnableThread(runnable); }
  void Kill(bool wait) {
    runnable_->Stop();
    if (wait) thread_.join();
  }

 private:
  explicit FRunnableThread(FRunnable* runnable) : runnable_(runnable), thread_([runnable] { runnable->Run(); }) {}
  FRunnable* runnable_;
  std::thread thread_;
};

struct FLiveLinkSkeletonStaticData {
  static int StaticStruct() { return 0; }
  void SetBoneNames(const TArray<FName>& names) { Names = names; }
  void SetBoneParents(const TArray<int32>& parents) { Parents = parents; }
  TArray<FName> Names;
  TArray<int32> Parents;
};
struct FLiveLinkWorldTime {
  FLiveLinkWorldTime() = default;
  explicit FLiveLinkWorldTime(double time) : Time(time) {}
  double Time = 0.0;
};
struct FLiveLinkAnimationFrameData {
  static int StaticStruct() { return 0; }
  FLiveLinkWorldTime WorldTime;
  TArray<FTransform> Transforms;
};
template <class Held>
struct LiveLinkStruct {
  explicit LiveLinkStruct(int) {}
  template <class T>
  T* Cast() {
    return &held;
  }
  Held held;
};
using FLiveLinkStaticDataStruct = LiveLinkStruct<FLiveLinkSkeletonStaticData>;
using FLiveLinkFrameDataStruct = LiveLinkStruct<FLiveLinkAnimationFrameData>;

struct ULiveLinkAnimationRole {
  static int StaticClass() { return 0; }
};
struct FLiveLinkSubjectKey {
  FLiveLinkSubjectKey(FGuid, FName name) : SubjectName(std::move(name)) {}
  FName SubjectName;
};

class ILiveLinkClient {
 public:
  virtual ~ILiveLinkClient() = default;
  virtual void PushSubjectStaticData_AnyThread(const FLiveLinkSubjectKey&, int role, FLiveLinkStaticDataStruct&&) = 0;
  virtual void PushSubjectFrameData_AnyThread(const FLiveLinkSubjectKey&, FLiveLinkFrameDataStruct&&) = 0;
};

class ILiveLinkSource {
 public:
  virtual ~ILiveLinkSource() = default;
  virtual void ReceiveClient(ILiveLinkClient* client, FGuid guid) = 0;
  virtual bool IsSourceStillValid() const = 0;
  virtual bool RequestSourceShutdown() = 0;
  virtual FText GetSourceType() const = 0;
  virtual FText GetSourceMachineName() const = 0;
  virtual FText GetSourceStatus() const = 0;
};

class ULiveLinkSourceFactory {
 public:
  enum class EMenuType { SubPanel, MenuEntry, Disabled };
  virtual ~ULiveLinkSourceFactory() = default;
  virtual FText GetSourceDisplayName() const = 0;
  virtual FText GetSourceTooltip() const = 0;
  virtual EMenuType GetMenuType() const = 0;
  virtual TSharedPtr<ILiveLinkSource> CreateSource(const FString& connection) const = 0;
};
