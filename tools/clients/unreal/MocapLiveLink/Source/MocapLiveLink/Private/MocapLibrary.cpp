#include "MocapLibrary.h"

#include "HAL/PlatformProcess.h"
#include "Interfaces/IPluginManager.h"
#include "Misc/Paths.h"

namespace {

#if PLATFORM_WINDOWS
const TCHAR* const kFile = TEXT("ThirdParty/mocap_client/lib/Win64/mocap_client.dll");
#else
const TCHAR* const kFile = TEXT("ThirdParty/mocap_client/lib/Linux/libmocap_client.so");
#endif

// Resolves functions by name; the first name that the library lacks is kept.
class FResolver {
 public:
  explicit FResolver(void* InHandle) : Handle(InHandle) {}

  template <class Function>
  void Find(Function& Into, const TCHAR* Name) {
    Into = reinterpret_cast<Function>(FPlatformProcess::GetDllExport(Handle, Name));
    if (Into == nullptr && Missing.IsEmpty()) Missing = Name;
  }

  FString Missing;

 private:
  void* Handle;
};

FString Resolve(FMocapLibrary& Library, void* Handle) {
  FResolver Resolver(Handle);
  Resolver.Find(Library.Abi, TEXT("mocap_client_abi"));
  Resolver.Find(Library.OptionsInit, TEXT("mocap_client_options_init"));
  Resolver.Find(Library.Open, TEXT("mocap_client_open"));
  Resolver.Find(Library.Close, TEXT("mocap_client_close"));
  Resolver.Find(Library.Wait, TEXT("mocap_client_wait"));
  Resolver.Find(Library.Diagnose, TEXT("mocap_client_diagnose"));
  Resolver.Find(Library.FrameNew, TEXT("mocap_frame_new"));
  Resolver.Find(Library.FrameFree, TEXT("mocap_frame_free"));
  Resolver.Find(Library.GetInfo, TEXT("mocap_frame_get_info"));
  Resolver.Find(Library.AgeNs, TEXT("mocap_frame_age_ns"));
  Resolver.Find(Library.Session, TEXT("mocap_frame_session"));
  Resolver.Find(Library.NominalRateHz, TEXT("mocap_frame_nominal_rate_hz"));
  Resolver.Find(Library.GetSubject, TEXT("mocap_frame_get_subject"));
  return Resolver.Missing;
}

FMocapLibrary Load() {
  FMocapLibrary Library;
  const TSharedPtr<IPlugin> Plugin = IPluginManager::Get().FindPlugin(TEXT("MocapLiveLink"));
  const FString Base = Plugin.IsValid() ? Plugin->GetBaseDir() : FString();
  const FString Path = FPaths::ConvertRelativePathToFull(FPaths::Combine(Base, FString(kFile)));
  const FString Folder = FPaths::GetPath(Path);
  FPlatformProcess::PushDllDirectory(*Folder);
  void* Handle = FPlatformProcess::GetDllHandle(*Path);
  FPlatformProcess::PopDllDirectory(*Folder);
  if (Handle == nullptr) {
    Library.Fault = FString(TEXT("cannot load ")) + Path +
                    TEXT(": create the plugin with tools/clients/unreal/pack.sh; on Linux install libzmq5");
    return Library;
  }
  const FString Missing = Resolve(Library, Handle);
  if (!Missing.IsEmpty()) {
    Library.Fault = Path + TEXT(" has no function ") + Missing + TEXT(": it is older than the plugin");
  } else if (Library.Abi() != MOCAP_CLIENT_ABI) {
    Library.Fault = Path + TEXT(" has another ABI than the plugin: take both from one build");
  }
  return Library;
}

}  // namespace

const FMocapLibrary& FMocapLibrary::Get() {
  static const FMocapLibrary Library = Load();
  return Library;
}
