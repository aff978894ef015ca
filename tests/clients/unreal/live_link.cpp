// The Live Link source on stand-ins for Unreal: prints what it pushed last. usage: clients_unreal ENDPOINT SECONDS
#include <chrono>
#include <cstdlib>

#include "MocapLiveLinkSource.h"

namespace {

struct Pushed {
  int skeletons = 0, frames = 0;
  FLiveLinkSkeletonStaticData skeleton;
  FLiveLinkAnimationFrameData frame;
};

class Engine final : public ILiveLinkClient {
 public:
  void PushSubjectStaticData_AnyThread(const FLiveLinkSubjectKey& key, int, FLiveLinkStaticDataStruct&& data) override {
    const std::lock_guard lock(mutex_);
    Pushed& pushed = subjects_[key.SubjectName.text];
    ++pushed.skeletons;
    pushed.skeleton = std::move(data.held);
  }
  void PushSubjectFrameData_AnyThread(const FLiveLinkSubjectKey& key, FLiveLinkFrameDataStruct&& data) override {
    const std::lock_guard lock(mutex_);
    Pushed& pushed = subjects_[key.SubjectName.text];
    ++pushed.frames;
    pushed.frame = std::move(data.held);
  }
  // Once nobody pushes any more.
  void print() const {
    const char* comma = "";
    std::printf("{");
    for (const auto& [name, pushed] : subjects_) {
      const FTransform& root = pushed.frame.Transforms.Values().at(0);
      std::printf("%s\n\"%s\": {\"skeletons\": %d, \"frames\": %d, \"bone\": \"%s\", \"parent\": %d, ", comma,
                  name.c_str(), pushed.skeletons, pushed.frames, pushed.skeleton.Names.Values().at(0).text.c_str(),
                  pushed.skeleton.Parents.Values().at(0));
      std::printf("\"age_s\": %.9g, \"position\": [%.9g, %.9g, %.9g], \"rotation_xyzw\": [%.9g, %.9g, %.9g, %.9g]}",
                  FPlatformTime::Seconds() - pushed.frame.WorldTime.Time, root.Translation.X, root.Translation.Y,
                  root.Translation.Z, root.Rotation.X, root.Rotation.Y, root.Rotation.Z, root.Rotation.W);
      comma = ",";
    }
    std::printf("\n}\n");
  }

 private:
  std::mutex mutex_;
  std::map<std::string, Pushed> subjects_;
};

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) return 64;
  Engine engine;
  const UMocapLiveLinkSourceFactory factory;
  const auto source = factory.CreateSource(FString(UTF8_TO_TCHAR(arguments[1])));
  if (!source->IsSourceStillValid()) return 1;
  source->ReceiveClient(&engine, FGuid());
  std::this_thread::sleep_for(std::chrono::duration<double>(std::atof(arguments[2])));  // the life of a level
  const FTCHARToUTF8 status(*source->GetSourceStatus().text);
  if (!source->RequestSourceShutdown() || source->IsSourceStillValid()) return 1;
  engine.print();
  std::fprintf(stderr, "%s\n", status.Get());
}
