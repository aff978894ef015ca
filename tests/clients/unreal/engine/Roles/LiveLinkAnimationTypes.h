#pragma once

#include "LiveLinkTypes.h"

struct FLiveLinkSkeletonStaticData : FLiveLinkBaseStaticData {
  static UScriptStruct* StaticStruct() { return StandIn::TypeOf<FLiveLinkSkeletonStaticData>(); }
  void SetBoneNames(const TArray<FName>& names) { BoneNames = names; }
  const TArray<FName>& GetBoneNames() const { return BoneNames; }
  void SetBoneParents(const TArray<int32>& parents) { BoneParents = parents; }
  const TArray<int32>& GetBoneParents() const { return BoneParents; }
  TArray<FName> BoneNames;
  TArray<int32> BoneParents;
};
struct FLiveLinkAnimationFrameData : FLiveLinkBaseFrameData {
  static UScriptStruct* StaticStruct() { return StandIn::TypeOf<FLiveLinkAnimationFrameData>(); }
  TArray<FTransform> Transforms;
};
