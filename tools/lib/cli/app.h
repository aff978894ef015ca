#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
class Validator;
}  // namespace CLI

namespace mocap::cli {

/// A condition on the text of an option. The error message and the help text name the condition.
class Check {
 public:
  explicit Check(CLI::Validator condition);
  Check(Check&&) noexcept;
  ~Check();

 private:
  friend class Option;
  std::unique_ptr<CLI::Validator> condition_;
};

/// A number from `least` to `most`, both included.
struct Range : Check {
  Range(int least, int most);
  Range(double least, double most);
  Range(std::size_t least, std::size_t most);
};

/// A number greater than zero.
struct PositiveNumber : Check {
  PositiveNumber();
};

/// One of these words.
struct IsMember : Check {
  explicit IsMember(std::vector<std::string> words);
  IsMember(std::initializer_list<std::string> words) : IsMember(std::vector<std::string>(words)) {}
};

/// The path of a file that exists.
struct ExistingFile : Check {
  ExistingFile();
};

/// An IPv4 address in dotted decimal notation.
struct ValidIPV4 : Check {
  ValidIPV4();
};

/// One option of an App. The App owns the Option.
class Option {
 public:
  explicit Option(CLI::Option& option) : option_(option) {}

  Option* check(const Check& condition);
  /// Shows the value that the variable has now as the default in the help text.
  Option* capture_default_str();
  /// The placeholder of the value in the help text.
  Option* type_name(std::string name);
  /// The heading of the help text under which the option stands; empty: the option is not shown.
  Option* group(std::string name);
  Option* required();
  Option* excludes(Option* other);
  Option* needs(Option* other);
  /// The number of values.
  Option* expected(int count);
  Option* expected(int least, int most);
  Option* delimiter(char between_values);
  /// Each occurrence of the option takes one value, so that a positional argument may follow it.
  Option* one_value_each();
  /// Replaces the text of the option before it is read.
  Option* transform(std::function<std::string(std::string)> replacement);

  /// Whether the command line has the option.
  explicit operator bool() const;

 private:
  CLI::Option& option_;
};

/// The types that App::add_option reads.
template <class T>
concept OptionValue = std::same_as<T, bool> || std::same_as<T, int> || std::same_as<T, unsigned> ||
    std::same_as<T, std::int64_t> || std::same_as<T, std::uint64_t> || std::same_as<T, double> ||
    std::same_as<T, std::string> || std::same_as<T, std::filesystem::path> || std::same_as<T, std::optional<double>> ||
    std::same_as<T, std::optional<int>> || std::same_as<T, std::optional<std::int64_t>> ||
    std::same_as<T, std::optional<std::uint64_t>> || std::same_as<T, std::array<int, 2>> ||
    std::same_as<T, std::vector<double>> || std::same_as<T, std::vector<std::string>> ||
    std::same_as<T, std::vector<std::filesystem::path>>;

/// "PROGRAM VERSION", the line that --version prints. `name`: "PROGRAM" or "PROGRAM COMMAND".
std::string version_of(std::string_view name);

/// The command line of a program, or of one subcommand. The first word of `name` is the program's, for --version, which
/// each subcommand takes too.
/// A thin wrapper of CLI11. Only app.cpp includes the header of CLI11, which takes 6 s to compile in each file. The
/// variables and the callbacks that are given to an App must outlive App::parse().
class App {
 public:
  explicit App(std::string about, std::string name = "");
  App(CLI::App& subcommand, std::string version);  ///< for add_subcommand
  ~App();
  App(const App&) = delete;
  App& operator=(const App&) = delete;

  /// Adds an option ("--name"), or a positional argument ("name"), that is read into `value`.
  template <OptionValue T>
  Option* add_option(std::string name, T& value, std::string help = "");
  /// Adds an option that `read` reads. An error text that `read` returns ends the program with exit code 64.
  Option* add_option(std::string name, std::function<std::optional<std::string>(const std::string&)> read,
                     std::string help);
  /// Adds an option whose words stand for the values of an enumeration or of a bool.
  template <class T>
  Option* add_choice(std::string name, T& value, std::vector<std::pair<std::string, T>> choices, std::string help);
  Option* add_flag(std::string name, bool& value, std::string help);
  App* add_subcommand(std::string name, std::string about);

  /// Prints `text` below the help text.
  void footer(std::string text);
  /// Prints "examples:" and these lines below the help text. Every program and subcommand has examples of its own.
  void examples(std::string lines);
  void require_subcommand(int count);
  /// Calls `run` when the command line has this subcommand.
  void callback(std::function<void()> run);

  /// Reads the command line. Returns the exit code if the program is to end now: 0 after --help, 64 (sysexits EX_USAGE)
  /// after an error, which is printed.
  [[nodiscard]] std::optional<int> parse(int argc, const char* const* argv);
  /// Prints an error of the command line that parse() does not see. Returns the exit code, 64.
  [[nodiscard]] int fail(const std::string& error) const;

  /// Whether the command line has this subcommand.
  bool parsed() const;
  bool got_subcommand(const std::string& name) const;
  /// `name` must have been added.
  App* get_subcommand(const std::string& name) const;
  Option* get_option(const std::string& name);
  std::string get_name() const;

 private:
  Option* keep(CLI::Option* option);

  std::unique_ptr<CLI::App> own_;  // empty in a subcommand: the App above owns it
  CLI::App& app_;
  std::string version_;  // what --version prints
  std::vector<std::unique_ptr<Option>> options_;
  std::vector<std::unique_ptr<App>> subcommands_;
};

template <class T>
Option* App::add_choice(std::string name, T& value, std::vector<std::pair<std::string, T>> choices, std::string help) {
  std::vector<std::string> words;
  for (const auto& [word, meaning] : choices) words.push_back(word);
  auto read = [&value, choices = std::move(choices)](const std::string& text) -> std::optional<std::string> {
    for (const auto& [word, meaning] : choices) {
      if (word == text) value = meaning;
    }
    return std::nullopt;  // the check below refuses other words
  };
  return add_option(std::move(name), std::move(read), std::move(help))->check(IsMember(std::move(words)));
}

}  // namespace mocap::cli
