#pragma once

#include "CoreMinimal.h"

// The settings of one source: what the panel asks for and the connection string of a Live Link preset keeps.
struct MOCAPLIVELINK_API FMocapSettings {
  FString Address;         // HOST, HOST:PORT, tcp://HOST:PORT or ipc://PATH; empty: this machine
  FString ServerKey;       // the daemon's public key, or a file with that key; empty: no encryption
  FString SecretKey;       // a file of `mocapctl keys new`, or the key: 40 characters
  FString PublicKey;       // only if SecretKey is no file
  bool bMeshAxes = false;  // the subject faces +Y, as the mesh of the Mannequin does; otherwise +X, as an actor does

  // The address with the protocol and the port, e.g. tcp://127.0.0.1:5570.
  FString Endpoint() const;

  // "endpoint=...;server_key=...;secret_key=...;public_key=...;axes=mesh"; members without a value are left out.
  FString ToString() const;

  // The inverse of ToString. Also reads an address alone. Unknown names are ignored with a warning in the log.
  static FMocapSettings FromString(const FString& Text);

  // The reason why ToString cannot keep the settings; empty: none.
  FString Fault() const;
};
