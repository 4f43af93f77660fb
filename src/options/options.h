// Command-line options: their declaration, and the values that were given. CLI11 parses them. Its
// headers take seconds to compile, so only options.cpp and config.cpp include them.
#pragma once

#include <concepts>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/result.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace polymorph {

/// Handle to an option. A chain of calls sets the option's properties:
/// command.add_option("--columns", columns, "N", "cells per row (4)").range(1, 1000);
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option& group(const char* name);  ///< heading of the option in help; default: "Main"
  Option& required();
  Option& environment(const char* variable);  ///< its value is used if the option is not given
  Option& excludes(const Option& other);
  Option& choices(const std::vector<std::string>& words);  ///< the allowed values
  Option& count(int low, int high);                        ///< takes from `low` to `high` values
  Option& one_value_each();                                ///< a list has one value per occurrence
  Option& bytes();  ///< a size as parse_size() parses it (options/amounts.h)
  /// Limits a number to [low, high]. The number is decimal, with '.' as the point, never
  /// hexadecimal or octal, and whole if T is an integer type.
  template <class T>
  Option& range(T low, std::type_identity_t<T> high) {
    if constexpr (std::integral<T>)
      return whole_range(low, high);
    else
      return real_range(low, high);
  }

 private:
  Option& whole_range(long long low, long long high);
  Option& real_range(double low, double high);

  CLI::Option* option_;
};

/// Handle to the program or a subcommand.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}

  /// Adds an option, or a positional argument if its name has no dashes ("scene"). `value` is a
  /// string, path, number or list of strings. It holds the default and must outlive the command's
  /// run. `value_name` is the name of the value in help: "FILE".
  template <class T>
  Option add_option(const std::string& names, T& value, const char* value_name,
                    const std::string& description) const;
  /// Adds an option whose value is one of some words. Each word stands for a value of an
  /// enumeration: `choices` are pairs of a word and the value that it stores in `value`.
  template <class T>
  Option add_choice(const std::string& names, T& value, const char* value_name,
                    const std::vector<std::pair<std::string, std::type_identity_t<T>>>& choices,
                    const std::string& description) const {
    std::vector<std::string> words;
    for (const auto& choice : choices) words.push_back(choice.first);
    const auto use = [&value, choices](const std::string& text) {
      for (const auto& [word, meaning] : choices)
        if (word == text) value = meaning;
    };
    return add_word(names, use, value_name, words, description);
  }
  Option add_flag(const std::string& names, bool& value, const std::string& description) const;
  /// Adds a flag; `value` counts its occurrences.
  Option add_flag(const std::string& names, int& value, const std::string& description) const;
  /// Adds an option with an optional value, which defaults to `fallback`. Parsing calls `use` with
  /// the value.
  Option add_optional_value(const std::string& name, std::function<void(const std::string&)> use,
                            const char* value_name, const char* fallback,
                            const std::string& description) const;
  /// Returns the option of this name, which must exist.
  Option option(const char* name) const;
  bool has_option(const char* name) const;
  std::string name() const;

  /// Sets a function that is called after parsing if the command is chosen.
  void on_chosen(std::function<void()> action) const;

 private:
  Option add_word(const std::string& names, std::function<void(const std::string&)> use,
                  const char* value_name, const std::vector<std::string>& words,
                  const std::string& description) const;

  CLI::App* app_;
};

/// Makes the program's command, without options and subcommands.
std::shared_ptr<CLI::App> make_program(const char* name, const char* purpose,
                                       const std::string& examples);
/// Handle to the program itself, for the options that stand before a subcommand.
Command program_command(CLI::App& program);
/// Adds a subcommand. Its help shows `purpose` (one line), `examples` and `exit_codes`.
Command add_subcommand(CLI::App& program, const std::string& name, const std::string& purpose,
                       const std::string& examples, const std::string& exit_codes);
std::vector<Command> list_subcommands(CLI::App& program);

/// Parses argv and stores the values in the variables of the options. Errors (kUsage): the message
/// suggests the nearest name for an unknown one.
Status parse_arguments(CLI::App& program, int argc, char** argv);

/// Returns the first word of argv that is a subcommand's name; empty: none.
std::string named_command(const CLI::App& program, int argc, char** argv);

/// The values of the chosen subcommand's positional arguments and of an option, and whether the
/// option is given; after parse_arguments().
std::vector<std::string> positional_values(const CLI::App& program);
std::vector<std::string> option_values(const CLI::App& program, const char* option);
bool is_given(const CLI::App& program, const char* option);

}  // namespace polymorph
