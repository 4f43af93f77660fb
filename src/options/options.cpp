#include "options/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "base/text.h"
#include "options/amounts.h"
#include "options/option_table.h"

namespace polymorph {
namespace {

constexpr const char* kDefaultGroup = "Main";

std::vector<const CLI::App*> all_commands(const CLI::App& program) {
  return program.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> command_names(const CLI::App& program) {
  std::vector<std::string> names;
  for (const CLI::App* command : all_commands(program)) names.push_back(command->get_name());
  return names;
}

/// Parses a number, checks its range, and replaces the text by its canonical form. Returns an error
/// message, or "" on success, as CLI11's validators do. `kind` qualifies the number in the message:
/// "whole " or "".
template <class T, class Parse>
std::string read_number(std::string& text, T low, T high, const char* kind, const Parse& parse) {
  const auto value = parse(text);
  if (!value || !(*value >= low && *value <= high))
    return fmt::format("{} is not a {}number from {} to {}", text, kind, low, high);
  text = fmt::format("{}", *value);
  return {};
}

/// Returns the words between the braces of an option's type in CLI11: "WHEN:{auto,always,never}".
std::vector<std::string> parse_choices(const std::string& type) {
  const auto open = type.find('{'), close = type.rfind('}');
  if (open == std::string::npos || close == std::string::npos) return {};
  return split(type.substr(open + 1, close - open - 1), ',');
}

OptionRow option_row(const CLI::Option& option) {
  OptionRow row;
  for (const std::string& name : option.get_snames()) row.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) row.names.push_back("--" + name);
  const std::string type = option.get_type_name();
  if (option.get_items_expected_max() > 0) row.value = type.substr(0, type.find(':'));
  row.choices = parse_choices(type);
  row.group = option.get_group();
  row.description = option.get_description();
  row.environment = option.get_envname();
  row.positional = option.get_positional();
  row.required = option.get_required();
  row.repeated = option.get_items_expected_max() > 1;
  return row;
}

/// Options of earlier versions, and their replacements.
constexpr std::pair<const char*, const char*> kRetiredOptions[] = {
    {"--noise", "--set image.noise=E"},      {"--denoise", "--set image.denoise=true"},
    {"--aovs", "--set image.aovs=LIST"},     {"--seed", "--set image.seed=N"},
    {"--isa", "the variable POLYMORPH_ISA"}, {"--only", "--frames"}};

/// Returns the error message for an unknown option, with its replacement or the nearest name.
std::string describe_unknown_option(const CLI::App& command, const std::string& word) {
  for (const auto& [name, replacement] : kRetiredOptions)
    if (word == name) return fmt::format("{} is now {}", name, replacement);
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  return fmt::format("unknown option \"{}\"{}", word, did_you_mean(word, known));
}

/// Returns the first unknown option, or "" if there is none. CLI11 may report another problem
/// first.
std::string first_unknown_option(const CLI::App& command, int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string argument =
        std::string(argv[i]).substr(0, std::string_view(argv[i]).find('='));
    if (argument.starts_with("--") && argument.size() > 2 && !command.get_option_no_throw(argument))
      return argument;
  }
  return "";
}

/// Rewrites CLI11's message "--method: soup not in {medial,hubbard}" as a sentence. If the option
/// is a positional argument, the message begins with its name ("verb: "), and the sentence names
/// the command instead. Returns other messages unchanged.
std::string rewrite_choice_error(const std::string& message, const std::string& command) {
  const auto list_begin = message.find(" not in {");  // 9 characters, skipped below
  if (list_begin == std::string::npos) return message;
  const auto colon = message.find(": ");
  const std::string name = message.substr(0, colon);
  const std::string value = message.substr(colon + 2, list_begin - colon - 2);
  std::vector<std::string> words = split(message.substr(list_begin + 9), ',');
  if (!words.empty() && words.back().ends_with('}')) words.back().pop_back();
  return fmt::format("{} \"{}\"{} - use {}", name.starts_with("-") ? name : command, value,
                     did_you_mean(value, words), fmt::join(words, ", "));
}

/// Rewrites CLI11's messages "reference is required", "--output: 1 required FILE missing", "The
/// following argument was not expected: x" and those of rewrite_choice_error() as sentences.
/// Returns other messages unchanged.
std::string rewrite_parse_error(const CLI::ParseError& error, const CLI::App& command) {
  const std::string message = error.what();
  const auto before = [&](const char* text) { return message.substr(0, message.find(text)); };
  if (message.ends_with(" is required")) {
    const CLI::Option* option = command.get_option_no_throw(before(" is required"));
    if (!option || !option->get_positional()) return message;
    const OptionRow row = option_row(*option);
    return fmt::format(
        "{} is missing{} - write {}", row.value,
        row.choices.empty() ? "" : fmt::format(" ({})", fmt::join(row.choices, ", ")),
        positional_usage(command_table(command)));
  }
  if (message.find(" required ") != std::string::npos && message.ends_with(" missing")) {
    const CLI::Option* option = command.get_option_no_throw(before(":"));
    if (!option) return message;
    return fmt::format("{} needs a value - write {} {}", before(":"), before(":"),
                       option_row(*option).value);
  }
  if (message.find(" excludes ") != std::string::npos)
    return fmt::format("{} and {} do not go together", before(" excludes "),
                       message.substr(message.find(" excludes ") + 10));  // 10: " excludes "
  if (message.find(" not expected: ") != std::string::npos) {
    // CLI11 lists the unparsed arguments in reverse order, after the 15 characters searched for.
    const auto words = split(message.substr(message.find(" not expected: ") + 15), ' ');
    const std::string& word = words.back();
    if (word.size() > 1 && word.starts_with("-")) return describe_unknown_option(command, word);
    return fmt::format("\"{}\" is one word too many - write {}", word,
                       positional_usage(command_table(command)));
  }
  return rewrite_choice_error(message, command.get_name());
}

/// Returns the message for an error of CLI11. An unknown command or option is reported first, since
/// it may have caused the error.
std::string describe_parse_error(const CLI::App& program, int argc, char** argv,
                                 const CLI::ParseError& error) {
  if (argc > 1 && argv[1][0] != '-') {
    const auto names = command_names(program);
    if (std::find(names.begin(), names.end(), argv[1]) == names.end())
      return fmt::format("unknown command \"{}\"{}", argv[1], did_you_mean(argv[1], names));
  }
  const std::string name = named_command(program, argc, argv);
  const CLI::App* command = name.empty() ? &program : program.get_subcommand(name);
  const std::string unknown = first_unknown_option(*command, argc, argv);
  return unknown.empty() ? rewrite_parse_error(error, *command)
                         : describe_unknown_option(*command, unknown);
}

/// Returns an option of the chosen subcommand, or null if that has no such option.
const CLI::Option* chosen_option(const CLI::App& program, const char* name) {
  return program.get_subcommands().front()->get_option_no_throw(name);
}

}  // namespace

Option& Option::group(const char* name) {
  option_->group(name);
  return *this;
}
Option& Option::required() {
  option_->required();
  return *this;
}
Option& Option::environment(const char* variable) {
  option_->envname(variable);
  return *this;
}
Option& Option::excludes(const Option& other) {
  option_->excludes(other.option_);
  return *this;
}
Option& Option::choices(const std::vector<std::string>& words) {
  option_->check(CLI::IsMember(words));
  return *this;
}
Option& Option::count(int low, int high) {
  option_->expected(low, high);
  return *this;
}
Option& Option::one_value_each() {
  option_->allow_extra_args(false);
  return *this;
}
Option& Option::bytes() {
  option_->transform(CLI::Validator(parse_size, std::string()));
  return *this;
}
Option& Option::whole_range(long long low, long long high) {
  option_->transform(CLI::Validator(
      [low, high](std::string& text) {
        return read_number(text, low, high, "whole ",
                           [](const auto& t) { return parse_integer(t); });
      },
      std::string()));
  return *this;
}
Option& Option::real_range(double low, double high) {
  option_->transform(CLI::Validator(
      [low, high](std::string& text) {
        return read_number(text, low, high, "", [](const auto& t) { return parse_number(t); });
      },
      std::string()));
  return *this;
}

template <class T>
Option Command::add_option(const std::string& names, T& value, const char* value_name,
                           const std::string& description) const {
  CLI::Option* option = app_->add_option(names, value, description);
  return Option(option->type_name(value_name)->group(kDefaultGroup));
}
template Option Command::add_option(const std::string&, std::string&, const char*,
                                    const std::string&) const;
template Option Command::add_option(const std::string&, std::filesystem::path&, const char*,
                                    const std::string&) const;
template Option Command::add_option(const std::string&, std::vector<std::string>&, const char*,
                                    const std::string&) const;
template Option Command::add_option(const std::string&, int&, const char*,
                                    const std::string&) const;
template Option Command::add_option(const std::string&, long long&, const char*,
                                    const std::string&) const;
template Option Command::add_option(const std::string&, std::uint64_t&, const char*,
                                    const std::string&) const;
template Option Command::add_option(const std::string&, float&, const char*,
                                    const std::string&) const;
template Option Command::add_option(const std::string&, double&, const char*,
                                    const std::string&) const;

Option Command::add_flag(const std::string& names, bool& value,
                         const std::string& description) const {
  return Option(app_->add_flag(names, value, description)->group(kDefaultGroup));
}
Option Command::add_flag(const std::string& names, int& value,
                         const std::string& description) const {
  return Option(app_->add_flag(names, value, description)->group(kDefaultGroup));
}
Option Command::add_optional_value(const std::string& name,
                                   std::function<void(const std::string&)> use,
                                   const char* value_name, const char* fallback,
                                   const std::string& description) const {
  CLI::Option* option = app_->add_option_function<std::string>(name, std::move(use), description);
  option->expected(0, 1)->default_str(fallback)->type_name(value_name);
  return Option(option->group(kDefaultGroup));
}
Option Command::add_word(const std::string& names, std::function<void(const std::string&)> use,
                         const char* value_name, const std::vector<std::string>& words,
                         const std::string& description) const {
  CLI::Option* option = app_->add_option_function<std::string>(names, std::move(use), description);
  option->type_name(value_name)->group(kDefaultGroup);
  return Option(option).choices(words);
}
Option Command::option(const char* name) const { return Option(app_->get_option(name)); }
bool Command::has_option(const char* name) const { return app_->get_option_no_throw(name); }
std::string Command::name() const { return app_->get_name(); }
void Command::on_chosen(std::function<void()> action) const { app_->callback(std::move(action)); }

std::shared_ptr<CLI::App> make_program(const char* name, const char* purpose,
                                       const std::string& examples) {
  auto program = std::make_shared<CLI::App>(purpose, name);
  program->footer("Examples:\n" + examples);
  program->require_subcommand(1);
  program->set_help_flag();  // removes CLI11's own; command_line.cpp has the program's
  return program;
}

Command program_command(CLI::App& program) { return Command(&program); }

Command add_subcommand(CLI::App& program, const std::string& name, const std::string& purpose,
                       const std::string& examples, const std::string& exit_codes) {
  CLI::App* command = program.add_subcommand(name, purpose);
  command->footer("Examples:\n" + examples + "\fExit codes:\n" + exit_codes);
  command->set_help_flag();
  return Command(command);
}

std::vector<Command> list_subcommands(CLI::App& program) {
  std::vector<Command> commands;
  for (CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
    commands.emplace_back(command);
  return commands;
}

Status parse_arguments(CLI::App& program, int argc, char** argv) {
  // Refuse empty values: they come from unset shell variables and do not mean the default.
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.empty())
      return make_error(ErrorCode::kUsage, "{}\"\": is empty - give a value, or leave it out",
                        argv[i - 1][0] == '-' ? fmt::format("{} ", argv[i - 1]) : "");
    if (word.starts_with("--") && word.find('=') == word.size() - 1)
      return make_error(ErrorCode::kUsage, "{}: is empty - give a value, or leave it out", word);
  }
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return Error{ErrorCode::kUsage, describe_parse_error(program, argc, argv, error)};
  }
  return Ok{};
}

std::string named_command(const CLI::App& program, int argc, char** argv) {
  const std::vector<std::string> names = command_names(program);
  for (int i = 1; i < argc; ++i)
    if (std::find(names.begin(), names.end(), argv[i]) != names.end()) return argv[i];
  return "";
}

std::vector<std::string> positional_values(const CLI::App& program) {
  std::vector<std::string> values;
  for (const CLI::Option* option : program.get_subcommands().front()->get_options())
    if (option->get_positional())
      values.insert(values.end(), option->results().begin(), option->results().end());
  return values;
}

std::vector<std::string> option_values(const CLI::App& program, const char* option) {
  const CLI::Option* match = chosen_option(program, option);
  return match ? match->results() : std::vector<std::string>{};
}

bool is_given(const CLI::App& program, const char* option) {
  const CLI::Option* match = chosen_option(program, option);
  return match && match->count() > 0;
}

CommandTable command_table(const CLI::App& command) {
  CommandTable table;
  if (command.get_parent()) table.name = command.get_name();
  table.purpose = command.get_description();
  // add_subcommand() joins examples and exit codes by a form feed, each with a heading line.
  const std::string footer = command.get_footer();
  const auto separator = footer.find('\f');
  const auto without_heading = [](const std::string& text) {
    const auto line = text.find('\n');
    return line == std::string::npos ? "" : text.substr(line + 1);
  };
  table.examples = without_heading(footer.substr(0, separator));
  if (separator != std::string::npos)
    table.exit_codes = without_heading(footer.substr(separator + 1));
  std::vector<std::string> groups;
  for (const CLI::Option* option : command.get_options()) {
    const std::string& group = option->get_group();
    if (group.empty()) continue;  // hidden
    if (std::find(groups.begin(), groups.end(), group) == groups.end()) groups.push_back(group);
    if (option->get_positional()) table.options.push_back(option_row(*option));
  }
  // Put the group "Common", whose options every command has, last.
  std::stable_partition(groups.begin(), groups.end(),
                        [](const std::string& group) { return group != "Common"; });
  for (const std::string& group : groups)
    for (const CLI::Option* option : command.get_options())
      if (option->get_group() == group && !option->get_positional())
        table.options.push_back(option_row(*option));
  return table;
}

std::vector<CommandTable> command_tables(const CLI::App& program) {
  std::vector<CommandTable> tables;
  for (const CLI::App* command : all_commands(program)) tables.push_back(command_table(*command));
  return tables;
}

}  // namespace polymorph
