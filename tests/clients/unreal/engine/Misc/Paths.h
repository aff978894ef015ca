#pragma once

#include "CoreMinimal.h"

struct FPaths {
  static FString Combine(const FString& folder, const FString& file) { return folder + TEXT("/") + file; }
  static FString ConvertRelativePathToFull(const FString& path) { return path; }
  static FString GetPath(const FString& path) {
    const std::wstring text(*path);
    return text.substr(0, text.find_last_of(L'/')).c_str();
  }
};
