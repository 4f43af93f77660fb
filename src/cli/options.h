// Command-line options: how the program and its subcommands declare them, and what was given. CLI11
// parses them; its headers take seconds to compile, so that only options.cpp and config.cpp include
// them.
#pragma once

#include <concepts>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "base/result.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace polymorph {

/// An option that was just declared. What else there is to say of it is chained:
/// command.add_option("--columns", columns, "cells per row (4)").range(1, 1000).type_name("N");
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option& type_name(const char* name);  ///< name of its value in the help: "FILE"
  Option& group(const char* name);      ///< its heading in help
  Option& required();
  Option& environment(const char* variable);  ///< read where the option is not given
  Option& excludes(const Option& other);
  Option& choices(const std::vector<std::string>& words);
  Option& choices_in_any_case(const std::vector<std::string>& words);
  Option& count(int low, int high);  ///< so many values
  Option& one_value_each();          ///< a list: the option is repeated for every value
  Option& bytes();                   ///< a size in bytes, or with K, M, G or T (1024 each)
  /// A number, written as a decimal ('.' as its point, no hexadecimal, no octal); whole where T is
  /// an integer.
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

/// The program or a subcommand; a handle, to be copied.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}

  /// A name without dashes ("scene") is a positional argument's. `value` is a string, path, number
  /// or list of strings that holds the default, and lives until the command has run.
  template <class T>
  Option add_option(const std::string& names, T& value, const std::string& description) const;
  Option add_flag(const std::string& names, bool& value, const std::string& description) const;
  /// Adds a flag that is counted.
  Option add_flag(const std::string& names, int& value, const std::string& description) const;
  /// An option whose value may be left out; it is `fallback` then. Each is handed to `use`.
  Option add_optional_value(const std::string& name, std::function<void(const std::string&)> use,
                            const char* fallback, const std::string& description) const;
  /// The option of this name, which exists.
  Option option(const char* name) const;
  bool has_option(const char* name) const;
  std::string name() const;

  /// Sets the action of the command when it is chosen, after its options are read.
  void on_chosen(std::function<void()> action) const;

 private:
  CLI::App* app_;
};

/// The program's own command, without subcommands.
std::shared_ptr<CLI::App> make_program(const char* name, const char* purpose,
                                       const std::string& examples);
Command root_of(CLI::App& program);
/// A subcommand with its one-line purpose, examples and exit codes.
Command add_subcommand(CLI::App& program, const std::string& name, const std::string& purpose,
                       const std::string& examples, const std::string& exit_codes);
std::vector<Command> subcommands_of(CLI::App& program);

/// Reads argv into what the options were declared with. Errors (kUsage): what is wrong, with the
/// nearest name where one is unknown.
Status parse_arguments(CLI::App& program, int argc, char** argv);

/// The subcommand that argv names; empty: none.
std::string named_command(const CLI::App& program, int argc, char** argv);

/// Arguments of the chosen subcommand, after parse_arguments().
std::vector<std::string> positional_values(const CLI::App& program);
std::vector<std::string> option_values(const CLI::App& program, const char* option);
bool is_given(const CLI::App& program, const char* option);

}  // namespace polymorph
