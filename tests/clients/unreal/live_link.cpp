// Runs the Live Link plugin with stand-ins for Unreal. The environment variable PLUGIN_FOLDER is the folder of the
// packed plugin.
//
// usage: clients_unreal run CONNECTION_STRING FRAMES SKELETONS REMOVED    until each subject has that many frames and
//                                                                         descriptions, and so many subjects were
//                                                                         removed
//        clients_unreal panel ADDRESS SERVER_KEY SECRET_KEY MESH(0|1)     fills in the panel and presses Connect
//        clients_unreal settings CONNECTION_STRING                        reads and writes a connection string
// Each prints one JSON object.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>

#include "HAL/PlatformTime.h"
#include "ILiveLinkClient.h"
#include "ILiveLinkSource.h"
#include "MocapLiveLinkSourceFactory.h"
#include "MocapSettings.h"
#include "Roles/LiveLinkAnimationTypes.h"
#include "Roles/LiveLinkTransformTypes.h"
#include "Widgets/Input/SButton.h"
#include "Widgets/Input/SCheckBox.h"
#include "Widgets/Input/SEditableTextBox.h"
#include "Widgets/Text/STextBlock.h"

namespace {

constexpr std::chrono::seconds kLimit(60);

std::string text_of(const FString& text) { return FTCHARToUTF8(*text).text; }
FString string_of(const char* text) { return FString(UTF8_TO_TCHAR(text)); }

// What the engine knows about one subject.
struct Subject {
  std::string role;
  int descriptions = 0, frames = 0;
  FLiveLinkSkeletonStaticData skeleton;
  FLiveLinkBaseFrameData frame;
  std::vector<FTransform> transforms;
  double farthest_cm = 0.0;  // distance of the root from the origin in any frame
};

void print(const FTransform& pose) {
  const FVector place = pose.GetTranslation();
  const FQuat turn = pose.GetRotation();
  std::printf("{\"position\": [%.9g, %.9g, %.9g], \"rotation_xyzw\": [%.9g, %.9g, %.9g, %.9g]}", place.X, place.Y,
              place.Z, turn.X, turn.Y, turn.Z, turn.W);
}

void print(const Subject& subject) {
  std::printf("{\"role\": \"%s\", \"descriptions\": %d, \"frames\": %d, \"bones\": [", subject.role.c_str(),
              subject.descriptions, subject.frames);
  const char* comma = "";
  for (int32 i = 0; i < subject.skeleton.GetBoneNames().Num(); ++i, comma = ", ") {
    std::printf("%s[\"%s\", %d]", comma, subject.skeleton.GetBoneNames()[i].text.c_str(),
                subject.skeleton.GetBoneParents()[i]);
  }
  const FQualifiedFrameTime& scene = subject.frame.MetaData.SceneTime;
  std::printf("], \"farthest_cm\": %.9g", subject.farthest_cm);
  std::printf(", \"age_s\": %.9g, \"scene\": {\"frame\": %d, \"fraction\": %.6g, \"rate\": [%d, %d]}, \"poses\": [",
              FPlatformTime::Seconds() - subject.frame.WorldTime.GetOffsettedTime(), scene.Time.FrameNumber.Value,
              static_cast<double>(scene.Time.GetSubFrame()), scene.Rate.Numerator, scene.Rate.Denominator);
  comma = "";
  for (const FTransform& pose : subject.transforms) {
    std::printf("%s", comma);
    print(pose);
    comma = ", ";
  }
  std::printf("]}");
}

class Engine final : public ILiveLinkClient {
 public:
  void PushSubjectStaticData_AnyThread(const FLiveLinkSubjectKey& key, TSubclassOf<ULiveLinkRole> role,
                                       FLiveLinkStaticDataStruct&& data) override {
    const std::lock_guard lock(mutex_);
    Subject& subject = subjects_[key.SubjectName.Name.text];
    subject.role = role.Get()->Name;
    ++subject.descriptions;
    if (data.GetStruct() == FLiveLinkSkeletonStaticData::StaticStruct())
      subject.skeleton = *data.Cast<FLiveLinkSkeletonStaticData>();
  }
  void PushSubjectFrameData_AnyThread(const FLiveLinkSubjectKey& key, FLiveLinkFrameDataStruct&& data) override {
    const std::lock_guard lock(mutex_);
    Subject& subject = subjects_[key.SubjectName.Name.text];
    ++subject.frames;
    subject.transforms.clear();
    if (subject.role == "Animation") {
      const auto& frame = *data.Cast<FLiveLinkAnimationFrameData>();
      subject.frame = frame;
      for (const FTransform& each : frame.Transforms) subject.transforms.push_back(each);
    } else {
      const auto& frame = *data.Cast<FLiveLinkTransformFrameData>();
      subject.frame = frame;
      subject.transforms.push_back(frame.Transform);
    }
    const FVector root = subject.transforms.at(0).GetTranslation();
    subject.farthest_cm = std::max(subject.farthest_cm, std::hypot(root.X, root.Y, root.Z));
  }
  void RemoveSubject_AnyThread(const FLiveLinkSubjectKey& key) override {
    const std::lock_guard lock(mutex_);
    removed_ += static_cast<int>(subjects_.erase(key.SubjectName.Name.text));
  }

  bool has(int frames, int descriptions, int removed) const {
    const std::lock_guard lock(mutex_);
    if (subjects_.empty() || removed_ < removed) return false;
    return std::all_of(subjects_.begin(), subjects_.end(), [&](const auto& each) {
      return each.second.frames >= frames && each.second.descriptions >= descriptions;
    });
  }
  void print_all(const std::string& status, const std::string& machine) const {
    std::printf("{\"status\": \"%s\", \"machine\": \"%s\", \"removed\": %d, \"subjects\": {", status.c_str(),
                machine.c_str(), removed_);
    const char* comma = "";
    for (const auto& [name, subject] : subjects_) {
      std::printf("%s\n\"%s\": ", comma, name.c_str());
      print(subject);
      comma = ",";
    }
    std::printf("\n}}\n");
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, Subject> subjects_;
  int removed_ = 0;
};

int run(const char* connection, int frames, int descriptions, int removed) {
  Engine engine;
  const UMocapLiveLinkSourceFactory factory;
  const TSharedPtr<ILiveLinkSource> source = factory.CreateSource(string_of(connection));
  if (!source->IsSourceStillValid()) {
    std::printf("{\"status\": \"%s\"}\n", text_of(source->GetSourceStatus().ToString()).c_str());
    return 1;
  }
  source->ReceiveClient(&engine, FGuid());
  const auto limit = std::chrono::steady_clock::now() + kLimit;
  std::string status;
  bool shown = false;
  while (std::chrono::steady_clock::now() < limit) {
    status = text_of(source->GetSourceStatus().ToString());
    if (!shown && engine.has(1, 1, 0)) {
      shown = true;
      std::fprintf(stderr, "shown\n");  // the test may change the feed now
    }
    if (engine.has(frames, descriptions, removed) && status == "all is well") break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (!source->RequestSourceShutdown() || source->IsSourceStillValid()) return 1;
  engine.print_all(status, text_of(source->GetSourceMachineName().ToString()));
  return engine.has(frames, descriptions, removed) ? 0 : 1;
}

// All widgets of one kind in the tree, in the order in which the panel shows them.
template <class Widget>
void find(const std::shared_ptr<SWidget>& in, std::vector<Widget*>& into) {
  if (auto* found = dynamic_cast<Widget*>(in.get())) into.push_back(found);
  for (const auto& child : in->Children) find(child, into);
}
template <class Widget>
std::vector<Widget*> find(const std::shared_ptr<SWidget>& in) {
  std::vector<Widget*> found;
  find(in, found);
  return found;
}

int panel(char** arguments) {
  const UMocapLiveLinkSourceFactory factory;
  std::string connection;
  int created = 0;
  const auto panel = factory.BuildCreationPanel(ULiveLinkSourceFactory::FOnLiveLinkSourceCreated::CreateLambda(
      [&](const TSharedPtr<ILiveLinkSource>& source, const FString& text) {
        created += source->IsSourceStillValid() ? 1 : 0;
        connection = text_of(text);
      }));
  const auto fields = find<SEditableTextBox>(panel.held);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (std::strcmp(arguments[i], "-") != 0) fields[i]->SetText(FText::FromString(string_of(arguments[i])));
  }
  if (std::strcmp(arguments[3], "1") == 0) find<SCheckBox>(panel.held).at(0)->ToggleCheckedState();
  const bool handled = find<SButton>(panel.held).at(0)->Click().IsEventHandled();
  std::printf("{\"menu\": %d, \"fields\": %zu, \"handled\": %d, \"created\": %d, \"connection\": \"%s\", \"texts\": [",
              static_cast<int>(factory.GetMenuType()), fields.size(), static_cast<int>(handled), created,
              connection.c_str());
  const char* comma = "";
  for (const STextBlock* each : find<STextBlock>(panel.held)) {
    std::printf("%s\"%s\"", comma, text_of(each->GetText().ToString()).c_str());
    comma = ", ";
  }
  std::printf("]}\n");
  return 0;
}

int settings(const char* connection) {
  const FMocapSettings read = FMocapSettings::FromString(string_of(connection));
  std::printf("{\"endpoint\": \"%s\", \"text\": \"%s\"}\n", text_of(read.Endpoint()).c_str(),
              text_of(read.ToString()).c_str());
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  const std::string mode = count > 1 ? arguments[1] : "";
  if (mode == "run" && count == 6)
    return run(arguments[2], std::atoi(arguments[3]), std::atoi(arguments[4]), std::atoi(arguments[5]));
  if (mode == "panel" && count == 6) return panel(arguments + 2);
  if (mode == "settings" && count == 3) return settings(arguments[2]);
  return 64;
}
