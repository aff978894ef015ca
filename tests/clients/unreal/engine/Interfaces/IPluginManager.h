#pragma once

#include <cstdlib>

#include "CoreMinimal.h"

class IPlugin {
 public:
  // In the tests the folder is that of the variable PLUGIN_FOLDER.
  const FString& GetBaseDir() const { return base_; }

 private:
  FString base_ = UTF8_TO_TCHAR(std::getenv("PLUGIN_FOLDER"));
};
class IPluginManager {
 public:
  static IPluginManager& Get() {
    static IPluginManager manager;
    return manager;
  }
  TSharedPtr<IPlugin> FindPlugin(const FString& name) {
    return name == TEXT("MocapLiveLink") ? TSharedPtr<IPlugin>(MakeShared<IPlugin>()) : TSharedPtr<IPlugin>();
  }
};
