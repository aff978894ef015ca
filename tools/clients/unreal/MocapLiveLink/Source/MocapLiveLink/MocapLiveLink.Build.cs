using System.IO;
using UnrealBuildTool;

public class MocapLiveLink : ModuleRules {
  public MocapLiveLink(ReadOnlyTargetRules Target) : base(Target) {
    PCHUsage = PCHUsageMode.UseExplicitOrSharedPCHs;
    PublicDependencyModuleNames.AddRange(new[] { "Core", "CoreUObject", "Engine", "LiveLinkInterface" });
    string client = Path.Combine(PluginDirectory, "ThirdParty", "mocap_client");
    PublicIncludePaths.Add(Path.Combine(client, "include"));
    PublicDefinitions.Add("MOCAP_CLIENT_STATIC=1");
    bool windows = Target.Platform == UnrealTargetPlatform.Win64;
    foreach (string name in new[] { "mocap_client", "zmq" }) {
      PublicAdditionalLibraries.Add(Path.Combine(client, "lib", windows ? name + ".lib" : "lib" + name + ".a"));
    }
    if (windows) PublicSystemLibraries.AddRange(new[] { "ws2_32.lib", "iphlpapi.lib" });
  }
}
