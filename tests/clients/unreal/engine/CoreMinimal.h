// The part of Unreal Engine that the Live Link source uses, so that it can be compiled and run without the engine.
// Every header of this folder has the path of the engine's header and declares only what that header declares. Names
// and signatures are those that public plugins for version 5 and Epic's documentation show. No code of the engine is
// copied.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

using int32 = std::int32_t;
using uint32 = std::uint32_t;
using int64 = std::int64_t;
using TCHAR = wchar_t;

#define PLATFORM_WINDOWS 0
#define PLATFORM_LINUX 1
#define TEXT(text) L##text
#define UCLASS(...)
#define USTRUCT(...)
#define GENERATED_BODY()
#define MOCAPLIVELINK_API
enum class ELogVerbosity { Error, Warning, Log };
// The engine's %s takes a TCHAR string; that of wprintf takes a char string.
#define UE_LOG(category, verbosity, format, ...) StandIn::Log(ELogVerbosity::verbosity, format, __VA_ARGS__)

// All texts in the tests are ASCII.
struct Utf8ToTchar {
  explicit Utf8ToTchar(const char* from) : text(from, from + std::char_traits<char>::length(from)) {}
  operator const TCHAR*() const { return text.c_str(); }
  std::wstring text;
};
#define UTF8_TO_TCHAR(text) static_cast<const TCHAR*>(Utf8ToTchar(text))

struct FTCHARToUTF8 {
  explicit FTCHARToUTF8(const TCHAR* from) {
    for (; *from != 0; ++from) text += static_cast<char>(*from);
  }
  const char* Get() const { return text.c_str(); }
  std::string text;
};

namespace StandIn {
inline void Log(ELogVerbosity, const TCHAR* format, const TCHAR* argument) {
  std::fprintf(stderr, "%s %s\n", FTCHARToUTF8(format).Get(), FTCHARToUTF8(argument).Get());
}
}  // namespace StandIn

template <class T>
class TArray {
 public:
  void Add(T value) { values_.push_back(std::move(value)); }
  int32 Num() const { return static_cast<int32>(values_.size()); }
  bool Contains(const T& value) const { return std::find(values_.begin(), values_.end(), value) != values_.end(); }
  void Empty() { values_.clear(); }
  const T& operator[](int32 index) const { return values_.at(static_cast<std::size_t>(index)); }
  auto begin() const { return values_.begin(); }
  auto end() const { return values_.end(); }

 private:
  std::vector<T> values_;
};

class FString {
 public:
  FString() = default;
  FString(const TCHAR* from) : text_(from) {}
  bool IsEmpty() const { return text_.empty(); }
  const TCHAR* operator*() const { return text_.c_str(); }
  bool Contains(const TCHAR* part) const { return text_.find(part) != std::wstring::npos; }
  bool EndsWith(const TCHAR* part) const {
    const std::wstring end(part);
    return text_.size() >= end.size() && text_.compare(text_.size() - end.size(), end.size(), end) == 0;
  }
  FString TrimStartAndEnd() const {
    const auto first = text_.find_first_not_of(L" \t\r\n");
    const auto last = text_.find_last_not_of(L" \t\r\n");
    return first == std::wstring::npos ? FString() : FString(text_.substr(first, last - first + 1).c_str());
  }
  bool Split(const FString& at, FString* left, FString* right) const {
    const auto found = text_.find(at.text_);
    if (found == std::wstring::npos) return false;
    *left = text_.substr(0, found).c_str();
    *right = text_.substr(found + at.text_.size()).c_str();
    return true;
  }
  int32 ParseIntoArray(TArray<FString>& into, const TCHAR* at, bool cull_empty) const {
    into.Empty();
    FString left;
    FString rest = *this;
    FString right;
    while (rest.Split(at, &left, &right)) {
      if (!cull_empty || !left.IsEmpty()) into.Add(left);
      rest = right;
    }
    if (!cull_empty || !rest.IsEmpty()) into.Add(rest);
    return into.Num();
  }
  FString& operator+=(const FString& other) {
    text_ += other.text_;
    return *this;
  }
  friend FString operator+(FString left, const FString& right) { return left += right; }
  // The engine compares without regard to case.
  friend bool operator==(const FString& left, const FString& right) {
    return std::equal(
        left.text_.begin(), left.text_.end(), right.text_.begin(), right.text_.end(),
        [](wchar_t a, wchar_t b) { return std::tolower(static_cast<int>(a)) == std::tolower(static_cast<int>(b)); });
  }
  friend bool operator!=(const FString& left, const FString& right) { return !(left == right); }

 private:
  std::wstring text_;
};

class FText {
 public:
  static FText FromString(const FString& from) {
    FText made;
    made.text_ = from;
    return made;
  }
  const FString& ToString() const { return text_; }

 private:
  FString text_;
};

struct FName {
  FName() = default;
  explicit FName(const TCHAR* from) : text(FTCHARToUTF8(from).text) {}
  friend bool operator==(const FName& left, const FName& right) { return left.text == right.text; }
  std::string text;
};

struct FGuid {};

template <class T>
T&& MoveTemp(T& value) {
  return static_cast<T&&>(value);
}

// Never null.
template <class T>
class TSharedRef {
 public:
  explicit TSharedRef(std::shared_ptr<T> made) : held(std::move(made)) {}
  template <class Derived>
  TSharedRef(const TSharedRef<Derived>& other) : held(other.held) {}
  T* operator->() const { return held.get(); }
  T& operator*() const { return *held; }
  std::shared_ptr<T> held;
};

template <class T>
class TSharedPtr {
 public:
  TSharedPtr() = default;
  template <class Derived>
  TSharedPtr(const TSharedRef<Derived>& other) : held(other.held) {}
  template <class Derived>
  TSharedPtr(const TSharedPtr<Derived>& other) : held(other.held) {}
  bool IsValid() const { return held != nullptr; }
  T* Get() const { return held.get(); }
  T* operator->() const { return held.get(); }
  std::shared_ptr<T> held;
};

template <class T, class... Arguments>
TSharedRef<T> MakeShared(Arguments&&... arguments) {
  return TSharedRef<T>(std::make_shared<T>(std::forward<Arguments>(arguments)...));
}

// Delegates: a callable that may be unbound.
template <class Signature>
class TDelegate;
template <class Result, class... Arguments>
class TDelegate<Result(Arguments...)> {
 public:
  template <class Callable>
  static TDelegate CreateLambda(Callable callable) {
    TDelegate made;
    made.bound_ = std::move(callable);
    return made;
  }
  bool IsBound() const { return bound_ != nullptr; }
  Result Execute(Arguments... arguments) const { return bound_(std::move(arguments)...); }
  bool ExecuteIfBound(Arguments... arguments) const {
    if (IsBound()) bound_(std::move(arguments)...);
    return IsBound();
  }

 private:
  std::function<Result(Arguments...)> bound_;
};
#define DECLARE_DELEGATE_TwoParams(Name, First, Second) using Name = TDelegate<void(First, Second)>

struct FMath {
  static double RoundToDouble(double value) { return std::floor(value + 0.5); }
  static double Fmod(double value, double by) { return std::fmod(value, by); }
  static double Clamp(double value, double low, double high) { return std::clamp(value, low, high); }
};

struct FVector {
  FVector(double x, double y, double z) : X(x), Y(y), Z(z) {}
  double X, Y, Z;
};
struct FQuat {
  FQuat(double x, double y, double z, double w) : X(x), Y(y), Z(z), W(w) {}
  FQuat Inverse() const { return {-X, -Y, -Z, W}; }
  // Rotates by the right operand first.
  FQuat operator*(const FQuat& q) const {
    return {W * q.X + X * q.W + Y * q.Z - Z * q.Y, W * q.Y - X * q.Z + Y * q.W + Z * q.X,
            W * q.Z + X * q.Y - Y * q.X + Z * q.W, W * q.W - X * q.X - Y * q.Y - Z * q.Z};
  }
  FVector RotateVector(const FVector& v) const {
    const FQuat turned = *this * FQuat(v.X, v.Y, v.Z, 0.0) * Inverse();
    return {turned.X, turned.Y, turned.Z};
  }
  double X, Y, Z, W;
};
class FTransform {
 public:
  FTransform() : FTransform(FQuat(0, 0, 0, 1), FVector(0, 0, 0)) {}
  FTransform(const FQuat& rotation, const FVector& translation) : rotation_(rotation), translation_(translation) {}
  FQuat GetRotation() const { return rotation_; }
  FVector GetTranslation() const { return translation_; }

 private:
  FQuat rotation_;
  FVector translation_;
};

class UObject {
 public:
  virtual ~UObject() = default;
};
class UClass {
 public:
  explicit UClass(const char* name) : Name(name) {}
  const char* Name;
};
template <class T>
class TSubclassOf {
 public:
  TSubclassOf(UClass* held) : held_(held) {}
  UClass* Get() const { return held_; }

 private:
  UClass* held_;
};
// A struct type that exists at run time.
class UScriptStruct {
 public:
  explicit UScriptStruct(std::shared_ptr<void> (*create)()) : Create(create) {}
  std::shared_ptr<void> (*Create)();
};
namespace StandIn {
template <class T>
UScriptStruct* TypeOf() {
  static UScriptStruct type(+[]() -> std::shared_ptr<void> { return std::make_shared<T>(); });
  return &type;
}
template <class T>
UClass* ClassOf(const char* name) {
  static UClass made(name);
  return &made;
}
}  // namespace StandIn
