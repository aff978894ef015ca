#pragma once

#include <thread>

#include "HAL/Runnable.h"

class FRunnableThread {
 public:
  static FRunnableThread* Create(FRunnable* runnable, const TCHAR*) { return new FRunnableThread(runnable); }
  bool Kill(bool wait) {
    runnable_->Stop();
    if (wait) thread_.join();
    return true;
  }

 private:
  explicit FRunnableThread(FRunnable* runnable) : runnable_(runnable), thread_([runnable] { runnable->Run(); }) {}
  FRunnable* runnable_;
  std::thread thread_;
};
