#include "cameras/aravis/aravis_describe.h"

#include <arpa/inet.h>
#include <fmt/format.h>
// The C headers of Aravis cause these warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

#include <algorithm>

#include "cameras/aravis/aravis_device.h"
#include "cameras/aravis/aravis_failure.h"
#include "cameras/aravis/glib_text.h"

namespace mocap::cameras {
namespace {

std::string choices_of(ArvGcEnumeration* node) {
  AravisFailure failure;
  guint count = 0;
  const char** const names = arv_gc_enumeration_dup_available_string_values(node, &count, failure);
  std::string text;
  for (guint i = 0; i < count && !failure.happened(); ++i) text += fmt::format("{}{}", i == 0 ? "" : ", ", names[i]);
  g_free(names);
  return text;
}

void read_kind(ArvGcNode* node, FeatureValue& feature) {
  AravisFailure failure;
  if (ARV_IS_GC_ENUMERATION(node)) {
    feature.kind = "enumeration";
    feature.range = choices_of(ARV_GC_ENUMERATION(node));
  } else if (ARV_IS_GC_COMMAND(node)) {
    feature.kind = "command";
  } else if (ARV_IS_GC_BOOLEAN(node)) {
    feature.kind = "boolean";
  } else if (ARV_IS_GC_FLOAT(node)) {
    feature.kind = "float";
    const double least = arv_gc_float_get_min(ARV_GC_FLOAT(node), failure);
    const double most = failure.happened() ? 0.0 : arv_gc_float_get_max(ARV_GC_FLOAT(node), failure);
    if (!failure.happened() && most < 1e300) feature.range = fmt::format("{} to {}", least, most);
  } else if (ARV_IS_GC_INTEGER(node)) {
    feature.kind = "integer";
    const gint64 least = arv_gc_integer_get_min(ARV_GC_INTEGER(node), failure);
    const gint64 most = failure.happened() ? 0 : arv_gc_integer_get_max(ARV_GC_INTEGER(node), failure);
    if (!failure.happened() && most < G_MAXINT64) feature.range = fmt::format("{} to {}", least, most);
  } else {
    feature.kind = "text";
  }
}

// `depth`: categories around this one. The bounds end the search in a category that contains itself.
void gather(ArvDevice* device, const char* name, const std::string& category, int depth,
            std::vector<FeatureValue>& into) {
  constexpr int kDeepest = 16;
  ArvGcNode* const node = arv_device_get_feature(device, name);
  if (node == nullptr || depth > kDeepest || into.size() > 4096) return;
  if (ARV_IS_GC_CATEGORY(node)) {
    for (const GSList* each = arv_gc_category_get_features(ARV_GC_CATEGORY(node)); each != nullptr; each = each->next) {
      gather(device, static_cast<const char*>(each->data), name, depth + 1, into);
    }
    return;
  }
  if (!ARV_IS_GC_FEATURE_NODE(node)) return;
  AravisFailure failure;
  FeatureValue feature;
  feature.category = category;
  feature.name = name;
  read_kind(node, feature);
  if (feature.kind != "command") {
    feature.value = text_of(arv_gc_feature_node_get_value_as_string(ARV_GC_FEATURE_NODE(node), failure));
  }
  feature.settable = arv_gc_feature_node_get_actual_access_mode(ARV_GC_FEATURE_NODE(node)) != ARV_GC_ACCESS_MODE_RO;
  into.push_back(std::move(feature));
}

}  // namespace

Result<std::vector<FeatureValue>> describe_aravis_camera(const AravisSettings& settings) {
  AravisSettings as_it_is = settings;
  as_it_is.pixel_format.clear();
  Result<std::unique_ptr<AravisDevice>> device = open_aravis_device(as_it_is, Seen::Never);
  if (!device) return device.error();
  std::vector<FeatureValue> features;
  gather(arv_camera_get_device((*device)->camera()), "Root", "", 0, features);
  return features;
}

AravisSettings aravis_settings_for(const std::string& word) {
  AravisSettings camera;
  in_addr address{};
  const bool is_address = inet_pton(AF_INET, word.c_str(), &address) == 1;
  const bool is_mac = std::count(word.begin(), word.end(), ':') == 5;
  (is_address ? camera.address : is_mac ? camera.mac : camera.serial) = word;
  camera.packet_socket = false;
  return camera;
}

}  // namespace mocap::cameras
