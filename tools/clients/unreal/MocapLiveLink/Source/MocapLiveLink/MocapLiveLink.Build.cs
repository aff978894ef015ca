using System.IO;
using UnrealBuildTool;

// The client library is loaded while the engine runs (FMocapLibrary), so nothing is linked; it is staged with the game.
public class MocapLiveLink : ModuleRules {
  public MocapLiveLink(ReadOnlyTargetRules Target) : base(Target) {
    PCHUsage = PCHUsageMode.UseExplicitOrSharedPCHs;
    PublicDependencyModuleNames.AddRange(new[] { "Core", "CoreUObject", "Engine", "LiveLinkInterface" });
    PrivateDependencyModuleNames.AddRange(new[] { "Projects", "Slate", "SlateCore" });

    string client = Path.Combine(PluginDirectory, "ThirdParty", "mocap_client");
    PublicSystemIncludePaths.Add(Path.Combine(client, "include"));
    PrivateDefinitions.Add("MOCAP_CLIENT_STATIC=1");  // declarations without dllimport
    string folder = Path.Combine(client, "lib", Target.Platform.ToString());
    if (!Directory.Exists(folder) || Directory.GetFiles(folder).Length == 0) {
      throw new BuildException("MocapLiveLink: no client library in " + folder +
                               ". Create the plugin with tools/clients/unreal/pack.sh of mocapd, which adds the library");
    }
    foreach (string library in Directory.GetFiles(folder)) RuntimeDependencies.Add(library, StagedFileType.NonUFS);
  }
}
