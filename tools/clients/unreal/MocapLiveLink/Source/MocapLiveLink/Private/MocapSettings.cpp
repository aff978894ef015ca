#include "MocapSettings.h"

namespace {

const TCHAR* const kDefaultHost = TEXT("127.0.0.1");
const TCHAR* const kDefaultPort = TEXT(":5570");

struct FNamedText {
  const TCHAR* Name;
  FString FMocapSettings::*Text;
};

const FNamedText kTexts[] = {{TEXT("endpoint"), &FMocapSettings::Address},
                             {TEXT("server_key"), &FMocapSettings::ServerKey},
                             {TEXT("secret_key"), &FMocapSettings::SecretKey},
                             {TEXT("public_key"), &FMocapSettings::PublicKey}};

// Sets the member called Name; returns false if there is none.
bool Set(FMocapSettings& Settings, const FString& Name, const FString& Value) {
  if (Name == TEXT("axes")) {
    Settings.bMeshAxes = Value == TEXT("mesh");
    return true;
  }
  for (const FNamedText& Each : kTexts) {
    if (Name != Each.Name) continue;
    Settings.*Each.Text = Value;
    return true;
  }
  return false;
}

}  // namespace

FString FMocapSettings::Endpoint() const {
  const FString Host = Address.IsEmpty() ? FString(kDefaultHost) : Address;
  if (Host.Contains(TEXT("://"))) return Host;
  const bool bHasPort = Host.Contains(TEXT(":")) && !Host.EndsWith(TEXT("]"));  // [::1] is an address of IPv6
  return FString(TEXT("tcp://")) + Host + (bHasPort ? TEXT("") : kDefaultPort);
}

FString FMocapSettings::ToString() const {
  FString Text = FString(TEXT("endpoint=")) + Endpoint();
  for (const FNamedText& Each : kTexts) {
    const FString& Value = this->*Each.Text;
    if (Each.Text == &FMocapSettings::Address || Value.IsEmpty()) continue;
    Text += FString(TEXT(";")) + Each.Name + TEXT("=") + Value;
  }
  if (bMeshAxes) Text += TEXT(";axes=mesh");
  return Text;
}

FMocapSettings FMocapSettings::FromString(const FString& Text) {
  FMocapSettings Settings;
  TArray<FString> Parts;
  Text.ParseIntoArray(Parts, TEXT(";"), true);
  for (const FString& Part : Parts) {
    FString Name;
    FString Value;
    if (!Part.Split(TEXT("="), &Name, &Value)) {  // a key may contain '=', the split is at the first
      Settings.Address = Part;
    } else if (!Set(Settings, Name, Value)) {
      UE_LOG(LogTemp, Warning, TEXT("mocapd: unknown setting '%s' in the connection string"), *Name);
    }
  }
  return Settings;
}

FString FMocapSettings::Fault() const {
  for (const FNamedText& Each : kTexts) {
    if ((this->*Each.Text).Contains(TEXT(";")))
      return FString(Each.Name) + TEXT(" contains ';': use a path without it");
  }
  return FString();
}
