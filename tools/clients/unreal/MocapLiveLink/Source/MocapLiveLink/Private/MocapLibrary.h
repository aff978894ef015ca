#pragma once

#include "CoreMinimal.h"
#include "mocap_client.h"

// The functions of the client library, which is loaded at first use from the plugin's folder ThirdParty.
struct FMocapLibrary {
  decltype(&::mocap_client_abi) Abi = nullptr;
  decltype(&::mocap_client_options_init) OptionsInit = nullptr;
  decltype(&::mocap_client_open) Open = nullptr;
  decltype(&::mocap_client_close) Close = nullptr;
  decltype(&::mocap_client_wait) Wait = nullptr;
  decltype(&::mocap_client_diagnose) Diagnose = nullptr;
  decltype(&::mocap_frame_new) FrameNew = nullptr;
  decltype(&::mocap_frame_free) FrameFree = nullptr;
  decltype(&::mocap_frame_get_info) GetInfo = nullptr;
  decltype(&::mocap_frame_age_ns) AgeNs = nullptr;
  decltype(&::mocap_frame_session) Session = nullptr;
  decltype(&::mocap_frame_nominal_rate_hz) NominalRateHz = nullptr;
  decltype(&::mocap_frame_get_subject) GetSubject = nullptr;

  FString Fault;  // the reason why the library cannot be used; empty: none

  // Call from the game thread.
  static const FMocapLibrary& Get();
};
