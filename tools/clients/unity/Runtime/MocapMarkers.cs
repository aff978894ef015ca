// Shows the markers of the feed as small objects, and lists them for scripts. The object is the volume: its origin, and its
// axes.
using System.Collections.Generic;
using UnityEngine;

namespace Mocap {

[AddComponentMenu("Mocap/Mocap Markers")]
public sealed class MocapMarkers : MocapReceiver {
  [Tooltip("Show the labelled markers of this subject; empty: of all subjects")]
  public string subject = "";
  public bool labelled = true;
  public bool unlabelled = true;
  [Tooltip("Copied for each marker; empty: a sphere")]
  public GameObject marker;
  [Tooltip("Diameter of the sphere, m")]
  public float diameter = 0.014f;

  /// The markers of the newest frame; none while the feed is silent. The next frame overwrites the list.
  public IList<ListedMarker> Markers { get { return markers_; } }

  readonly List<ListedMarker> markers_ = new List<ListedMarker>();
  readonly List<GameObject> shown_ = new List<GameObject>();

  protected override void Show(Frame frame, bool isNew) {
    if (!isNew) return;
    MarkerList.Read(frame, subject, labelled, unlabelled, markers_);
    Place();
  }

  protected override void ShowNothing() {
    markers_.Clear();
    Place();
  }

  void Place() {
    while (shown_.Count < markers_.Count) shown_.Add(Create());
    for (int i = 0; i < shown_.Count; ++i) {
      shown_[i].SetActive(i < markers_.Count);
      if (i < markers_.Count) shown_[i].transform.localPosition = ToUnity.Position(markers_[i].Position);
    }
  }

  GameObject Create() {
    GameObject made;
    if (marker != null) {
      made = Instantiate(marker, transform);
    } else {
      made = GameObject.CreatePrimitive(PrimitiveType.Sphere);
      Destroy(made.GetComponent<Collider>());
      made.transform.SetParent(transform, false);
      made.transform.localScale = new Vector3(diameter, diameter, diameter);
    }
    made.name = "marker " + shown_.Count;
    return made;
  }

  protected override string Describe() { return markers_.Count + " markers"; }

  void OnDisable() {
    foreach (GameObject each in shown_) Destroy(each);
    shown_.Clear();
    markers_.Clear();
  }
}

}  // namespace Mocap
