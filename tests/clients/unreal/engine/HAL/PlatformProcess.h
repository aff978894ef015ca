#pragma once

#include <dlfcn.h>

#include "CoreMinimal.h"

struct FPlatformProcess {
  static void* GetDllHandle(const TCHAR* path) { return dlopen(FTCHARToUTF8(path).Get(), RTLD_NOW | RTLD_LOCAL); }
  static void* GetDllExport(void* handle, const TCHAR* name) { return dlsym(handle, FTCHARToUTF8(name).Get()); }
  static void PushDllDirectory(const TCHAR*) {}
  static void PopDllDirectory(const TCHAR*) {}
};
