#include "lib/cli/app.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>

#include "base/exit_codes.h"
#include "base/expects.h"

namespace mocap::cli {
namespace {

int print_error(const CLI::App& app, const CLI::ParseError& error) {
  return app.exit(error) == 0 ? kExitOk : kExitUsage;
}

constexpr std::size_t kColumns = 80;

// Breaks each line of `text` between words, so that no line has more than `columns` characters unless a word has.
std::string wrapped(const std::string& text, std::size_t columns) {
  std::string all;
  std::size_t used = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find_first_of(" \n", begin), text.size());
    const std::size_t length = end - begin;
    if (used > 0 && used + 1 + length > columns) {
      all += '\n';
      used = 0;
    } else if (used > 0) {
      all += ' ';
      ++used;
    }
    all.append(text, begin, length);
    used += length;
    if (end < text.size() && text[end] == '\n') {
      all += '\n';
      used = 0;
    }
    begin = end + 1;
  }
  return all;
}

// Indents each line but the first.
std::string indented(std::string text, std::size_t columns) {
  for (std::size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n', end + 1)) {
    text.insert(end + 1, columns, ' ');
  }
  return text;
}

// A line of a footer in lines of 80 columns. The explanation that follows a command after two or more spaces moves to
// the next line.
std::string wrapped_example(const std::string& line) {
  constexpr std::size_t kIndent = 6;
  if (line.size() <= kColumns) return line;
  const std::size_t begin = line.find_first_not_of(' ');
  const std::size_t gap = line.find("  ", begin);
  const std::string explanation = std::string(kIndent, ' ');
  if (gap != std::string::npos) {
    const std::string right = line.substr(line.find_first_not_of(' ', gap));
    return wrapped_example(line.substr(0, gap)) + '\n' + explanation +
           indented(wrapped(right, kColumns - kIndent), kIndent);
  }
  if (begin == 0) return wrapped(line, kColumns);
  if (begin > kIndent) return explanation + indented(wrapped(line.substr(begin), kColumns - kIndent), kIndent);
  // A command: the shell continues a line that ends with a backslash.
  std::string command = indented(wrapped(line.substr(begin), kColumns - kIndent - 2), kIndent);
  for (std::size_t end = command.find('\n'); end != std::string::npos; end = command.find('\n', end + 3)) {
    command.insert(end, " \\");
  }
  return std::string(begin, ' ') + command;
}

// The help text of CLI11 in lines of 80 columns.
class Formatter : public CLI::Formatter {
 public:
  std::string make_option_desc(const CLI::Option* option) const override {
    return wrapped(CLI::Formatter::make_option_desc(option), kColumns - column_width_);
  }
  std::string make_subcommand(const CLI::App* subcommand) const override {
    std::ostringstream out;
    CLI::detail::format_help(out, subcommand->get_name(),
                             wrapped(subcommand->get_description(), kColumns - column_width_), column_width_);
    return out.str();
  }
  std::string make_description(const CLI::App* app) const override {
    return wrapped(CLI::Formatter::make_description(app), kColumns);
  }
  std::string make_footer(const CLI::App* app) const override {
    std::istringstream lines(CLI::Formatter::make_footer(app));
    std::string all;
    for (std::string line; std::getline(lines, line);) all += wrapped_example(line) + '\n';
    return all;
  }
};

}  // namespace

std::string version_of(std::string_view name) {
  return std::string(name.substr(0, name.find(' '))) + " " MOCAP_VERSION;
}

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

Option* Option::one_value_each() {
  option_.allow_extra_args(false);
  return this;
}

Option* Option::transform(std::function<std::string(std::string)> replacement) {
  option_.transform(std::move(replacement));
  return this;
}

Option::operator bool() const { return static_cast<bool>(option_); }

App::App(std::string about, std::string name)
    : own_(std::make_unique<CLI::App>(std::move(about), std::move(name))),
      app_(*own_),
      version_(version_of(own_->get_name())) {
  app_.formatter(std::make_shared<Formatter>());  // subcommands inherit it
  app_.set_version_flag("--version", version_);
}
App::App(CLI::App& subcommand, std::string version) : app_(subcommand), version_(std::move(version)) {
  app_.set_version_flag("--version", version_)->group("");  // works, but is not listed
}
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
  return subcommands_.emplace_back(std::make_unique<App>(*subcommand, version_)).get();
}

void App::footer(std::string text) { app_.footer(std::move(text)); }

void App::examples(std::string lines) { app_.footer("examples:\n" + std::move(lines)); }

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

}  // namespace mocap::cli
