// The part of UnrealBuildTool that the plugin's rules use, and a program that prints what the rules of MocapLiveLink say.
// usage: Rules.exe PLUGIN_FOLDER PLATFORM
using System;
using System.Collections.Generic;

namespace UnrealBuildTool {

public struct UnrealTargetPlatform {
  readonly string name_;
  public UnrealTargetPlatform(string name) { name_ = name; }
  public override string ToString() { return name_; }
}
public class ReadOnlyTargetRules { public UnrealTargetPlatform Platform; }
public class BuildException : Exception { public BuildException(string message) : base(message) { } }
public enum StagedFileType { UFS, NonUFS }
public sealed class RuntimeDependencyList {
  public readonly List<string> Staged = new List<string>();
  public void Add(string path, StagedFileType type) { Staged.Add(type + " " + path); }
}

public class ModuleRules {
  public static string Folder;  // not in the build tool, which knows the folder
  public enum PCHUsageMode { Default, UseExplicitOrSharedPCHs }
  public PCHUsageMode PCHUsage;
  public string PluginDirectory { get { return Folder; } }
  public readonly List<string> PublicDependencyModuleNames = new List<string>();
  public readonly List<string> PrivateDependencyModuleNames = new List<string>();
  public readonly List<string> PublicSystemIncludePaths = new List<string>();
  public readonly List<string> PrivateDefinitions = new List<string>();
  public readonly RuntimeDependencyList RuntimeDependencies = new RuntimeDependencyList();
  public ModuleRules(ReadOnlyTargetRules target) { }
}

}  // namespace UnrealBuildTool

static class Rules {
  static void Say(string what, IEnumerable<string> values) {
    foreach (string value in values) Console.WriteLine(what + " " + value);
  }

  static int Main(string[] a) {
    UnrealBuildTool.ModuleRules.Folder = a[0];
    var target = new UnrealBuildTool.ReadOnlyTargetRules { Platform = new UnrealBuildTool.UnrealTargetPlatform(a[1]) };
    try {
      var rules = new MocapLiveLink(target);
      Say("module", rules.PublicDependencyModuleNames);
      Say("module", rules.PrivateDependencyModuleNames);
      Say("include", rules.PublicSystemIncludePaths);
      Say("staged", rules.RuntimeDependencies.Staged);
    } catch (UnrealBuildTool.BuildException fault) {
      Console.Error.WriteLine(fault.Message);
      return 1;
    }
    return 0;
  }
}
