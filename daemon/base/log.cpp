#include "base/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/dup_filter_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <string>

namespace mocap {
namespace {

// systemd's priority prefix, sd-daemon(3).
class JournalPriority : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const char digit = message.level >= spdlog::level::err    ? '3'
                       : message.level == spdlog::level::warn ? '4'
                       : message.level == spdlog::level::info ? '6'
                                                              : '7';
    out.push_back('<');
    out.push_back(digit);
    out.push_back('>');
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<JournalPriority>(); }
};

// The four words an operator learns: debug, info, warn, error.
class LevelWord : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const std::string_view word = message.level >= spdlog::level::err    ? "error"
                                  : message.level == spdlog::level::warn ? "warn "
                                  : message.level == spdlog::level::info ? "info "
                                                                         : "debug";
    out.append(word.data(), word.data() + word.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<LevelWord>(); }
};

std::unique_ptr<spdlog::formatter> formatter(bool journal) {
  auto made = std::make_unique<spdlog::pattern_formatter>();
  made->add_flag<JournalPriority>('*').add_flag<LevelWord>('&');
  if (journal) {
    made->set_pattern("%*%v");
  } else {
    made->set_pattern("%H:%M:%S.%e %& %v");
  }
  return made;
}

spdlog::logger& logger() {
  static const std::shared_ptr<spdlog::logger> instance = [] {
    auto folded = std::make_shared<spdlog::sinks::dup_filter_sink_mt>(std::chrono::seconds(1));
    folded->add_sink(std::make_shared<spdlog::sinks::stderr_sink_mt>());
    auto made = std::make_shared<spdlog::logger>("mocapd", folded);
    made->set_formatter(formatter(false));
    made->flush_on(spdlog::level::warn);
    return made;
  }();
  return *instance;
}

void write(spdlog::level::level_enum level, std::string_view who, std::string_view what) {
  try {
    logger().log(level, "{}: {}", who, what);
  } catch (...) {  // a log that cannot be written must not end the service
  }
}

}  // namespace

void log_debug(std::string_view who, std::string_view what) { write(spdlog::level::debug, who, what); }
void log_info(std::string_view who, std::string_view what) { write(spdlog::level::info, who, what); }
void log_warn(std::string_view who, std::string_view what) { write(spdlog::level::warn, who, what); }
void log_error(std::string_view who, std::string_view what) { write(spdlog::level::err, who, what); }

void set_log_level(LogLevel level) {
  switch (level) {
    case LogLevel::Debug: return logger().set_level(spdlog::level::debug);
    case LogLevel::Info: return logger().set_level(spdlog::level::info);
    case LogLevel::Warn: return logger().set_level(spdlog::level::warn);
    case LogLevel::Error: return logger().set_level(spdlog::level::err);
  }
}

void set_log_for_journal(bool journal) { logger().set_formatter(formatter(journal)); }

}  // namespace mocap
