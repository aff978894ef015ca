// The part of UnityEditor that the package uses. See UnityEngine.cs.
using System;

namespace UnityEditor {

[AttributeUsage(AttributeTargets.Class)]
public sealed class CustomEditor : Attribute {
  public CustomEditor(Type inspectedType) { }
  public CustomEditor(Type inspectedType, bool editorForChildClasses) { }
}

public class Editor : UnityEngine.Object {
  public UnityEngine.Object target { get; set; }
  public virtual void OnInspectorGUI() { }
  public virtual bool RequiresConstantRepaint() { return false; }
  public bool DrawDefaultInspector() { return false; }
}

public enum MessageType { None, Info, Warning, Error }
public static class EditorGUILayout { public static void HelpBox(string message, MessageType type) { } }

}  // namespace UnityEditor
