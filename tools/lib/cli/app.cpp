#include "lib/cli/app.h"

#include <CLI/CLI.hpp>

#include "base/exit_codes.h"
#include "base/expects.h"

namespace mocap::cli {
namespace {

int print_error(const CLI::App& app, const CLI::ParseError& error) {
  return app.exit(error) == 0 ? kExitOk : kExitUsage;
}

}  // namespace

Check::Check(CLI::Validator condition) : condition_(std::make_unique<CLI::Validator>(std::move(condition))) {}
Check::Check(Check&&) noexcept = default;
Check::~Check() = default;

Range::Range(int least, int most) : Check(CLI::Range(least, most)) {}
Range::Range(double least, double most) : Check(CLI::Range(least, most)) {}
Range::Range(std::size_t least, std::size_t most) : Check(CLI::Range(least, most)) {}
PositiveNumber::PositiveNumber() : Check(CLI::PositiveNumber) {}
IsMember::IsMember(std::vector<std::string> words) : Check(CLI::IsMember(std::move(words))) {}
ExistingFile::ExistingFile() : Check(CLI::ExistingFile) {}
ValidIPV4::ValidIPV4() : Check(CLI::ValidIPV4) {}

Option* Option::check(const Check& condition) {
  option_.check(*condition.condition_);
  return this;
}

Option* Option::capture_default_str() {
  option_.capture_default_str();
  return this;
}

Option* Option::type_name(std::string name) {
  option_.type_name(std::move(name));
  return this;
}

Option* Option::group(std::string name) {
  option_.group(std::move(name));
  return this;
}

Option* Option::required() {
  option_.required();
  return this;
}

Option* Option::excludes(Option* other) {
  option_.excludes(&other->option_);
  return this;
}

Option* Option::needs(Option* other) {
  option_.needs(&other->option_);
  return this;
}

Option* Option::expected(int count) {
  option_.expected(count);
  return this;
}

Option* Option::expected(int least, int most) {
  option_.expected(least, most);
  return this;
}

Option* Option::delimiter(char between_values) {
  option_.delimiter(between_values);
  return this;
}

Option* Option::transform(std::function<std::string(std::string)> replacement) {
  option_.transform(std::move(replacement));
  return this;
}

Option::operator bool() const { return static_cast<bool>(option_); }

App::App(std::string about, std::string name)
    : own_(std::make_unique<CLI::App>(std::move(about), std::move(name))), app_(*own_) {}
App::App(CLI::App& subcommand) : app_(subcommand) {}
App::~App() = default;

Option* App::keep(CLI::Option* option) { return options_.emplace_back(std::make_unique<Option>(*option)).get(); }

template <OptionValue T>
Option* App::add_option(std::string name, T& value, std::string help) {
  return keep(app_.add_option(std::move(name), value, std::move(help)));
}
template Option* App::add_option(std::string, bool&, std::string);
template Option* App::add_option(std::string, int&, std::string);
template Option* App::add_option(std::string, unsigned&, std::string);
template Option* App::add_option(std::string, std::int64_t&, std::string);
template Option* App::add_option(std::string, std::uint64_t&, std::string);
template Option* App::add_option(std::string, double&, std::string);
template Option* App::add_option(std::string, std::string&, std::string);
template Option* App::add_option(std::string, std::filesystem::path&, std::string);
template Option* App::add_option(std::string, std::optional<double>&, std::string);
template Option* App::add_option(std::string, std::optional<int>&, std::string);
template Option* App::add_option(std::string, std::optional<std::int64_t>&, std::string);
template Option* App::add_option(std::string, std::optional<std::uint64_t>&, std::string);
template Option* App::add_option(std::string, std::array<int, 2>&, std::string);
template Option* App::add_option(std::string, std::vector<double>&, std::string);
template Option* App::add_option(std::string, std::vector<std::string>&, std::string);
template Option* App::add_option(std::string, std::vector<std::filesystem::path>&, std::string);

Option* App::add_option(std::string name, std::function<std::optional<std::string>(const std::string&)> read,
                        std::string help) {
  const auto read_or_throw = [name, read = std::move(read)](const std::string& text) {
    if (const std::optional<std::string> error = read(text)) throw CLI::ValidationError(name, *error);
  };
  return keep(app_.add_option_function<std::string>(name, read_or_throw, std::move(help)));
}

Option* App::add_flag(std::string name, bool& value, std::string help) {
  return keep(app_.add_flag(std::move(name), value, std::move(help)));
}

App* App::add_subcommand(std::string name, std::string about) {
  CLI::App* const subcommand = app_.add_subcommand(std::move(name), std::move(about));
  return subcommands_.emplace_back(std::make_unique<App>(*subcommand)).get();
}

void App::footer(std::string text) { app_.footer(std::move(text)); }

void App::require_subcommand(int count) { app_.require_subcommand(count); }

void App::callback(std::function<void()> run) { app_.callback(std::move(run)); }

std::optional<int> App::parse(int argc, const char* const* argv) {
  try {
    app_.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return print_error(app_, error);
  }
  return std::nullopt;
}

int App::fail(const std::string& error) const { return print_error(app_, CLI::ValidationError(error)); }

bool App::parsed() const { return app_.parsed(); }

bool App::got_subcommand(const std::string& name) const { return app_.got_subcommand(name); }

App* App::get_subcommand(const std::string& name) const {
  for (const auto& subcommand : subcommands_) {
    if (subcommand->app_.get_name() == name) return subcommand.get();
  }
  MOCAP_EXPECTS(false);
  return nullptr;
}

Option* App::get_option(const std::string& name) { return keep(app_.get_option(name)); }

std::string App::get_name() const { return app_.get_name(); }

std::vector<const App*> App::subcommands() const {
  std::vector<const App*> all;
  for (const auto& subcommand : subcommands_) all.push_back(subcommand.get());
  return all;
}

std::vector<std::string> App::option_names() const {
  std::vector<std::string> names;
  for (const CLI::Option* option : app_.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back(name);
  }
  return names;
}

}  // namespace mocap::cli
