#include "options/config.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>

#include "base/file.h"
#include "base/odd_names.h"
#include "base/text.h"

namespace polymorph {
namespace {

/// Lists the keys that a file may have for a command: the long names of its options, except for
/// --config.
std::vector<std::string> option_keys(const CLI::App& command) {
  std::vector<std::string> keys;
  for (const CLI::Option* option : command.get_options())
    if (!option->get_lnames().empty() && option->get_lnames().front() != "config")
      keys.push_back(option->get_lnames().front());
  return keys;
}

/// Returns the values of an item as the option parses them. Returns nothing for a flag that is
/// false.
std::vector<std::string> parse_values(const CLI::ConfigItem& item, const CLI::Option& option) {
  if (option.get_expected_max() > 0) return item.inputs;  // the option takes values
  const std::string& word = item.inputs.empty() ? "true" : item.inputs.front();
  if (word == "false") return {};
  return {option.get_flag_value("--" + item.name, word)};
}

/// Tests whether the command line or the environment has set the option or one that excludes it.
bool is_set(const CLI::Option& option) {
  const auto& excluded = option.get_excludes();
  return option.count() > 0 || std::any_of(excluded.begin(), excluded.end(),
                                           [](const CLI::Option* o) { return o->count() > 0; });
}

Error make_config_error(const std::string& file, const CLI::ConfigItem& item,
                        const std::string& reason) {
  const std::string section = item.parents.empty() ? "" : "[" + item.parents.front() + "] ";
  return make_error(ErrorCode::kUsage, "{}: {}{}: {}", file, section, item.name, reason);
}

/// Finds the commands that a key applies to: that of its section, or all if it has no section.
Result<std::vector<CLI::App*>> find_commands(const std::string& file, const CLI::ConfigItem& item,
                                             CLI::App& app) {
  std::vector<CLI::App*> commands = app.get_subcommands([](const CLI::App*) { return true; });
  if (item.parents.size() > 1)
    return make_config_error(file, item, "sections have no sections of their own");
  if (item.parents.empty()) return commands;
  std::vector<std::string> names;
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  std::erase_if(commands, [&](const CLI::App* c) { return c->get_name() != item.parents.front(); });
  if (commands.empty())
    return make_config_error(
        file, item, "the section names no command" + did_you_mean(item.parents.front(), names));
  return commands;
}

}  // namespace

Status apply_config(const std::string& file, CLI::App& program) {
  CLI::App& command = *program.get_subcommands().front();
  auto text = read_file(file, /*limit=*/1u << 20);
  if (!text) return Error{ErrorCode::kUsage, "--config " + text.error().message};
  std::istringstream stream(*text);
  std::vector<CLI::ConfigItem> items;
  try {
    items = CLI::ConfigBase().from_config(stream);
  } catch (const CLI::Error& error) {
    return make_error(ErrorCode::kUsage, "--config {}: {}", file, error.what());
  }
  for (CLI::ConfigItem& item : items) {
    if (item.name == "++" || item.name == "--") continue;  // begin or end of a section
    std::replace(item.name.begin(), item.name.end(), '_', '-');
    PM_TRY(const std::vector<CLI::App*> commands, find_commands(file, item, program));
    // Check the key against all commands that its section names.
    std::vector<std::string> known_keys;
    bool is_known = false;
    for (CLI::App* candidate : commands) {
      const std::vector<std::string> keys = option_keys(*candidate);
      is_known = is_known || std::find(keys.begin(), keys.end(), item.name) != keys.end();
      known_keys.insert(known_keys.end(), keys.begin(), keys.end());
    }
    if (!is_known)
      return make_config_error(file, item, "unknown option" + did_you_mean(item.name, known_keys));
    // Store its values if it applies to the chosen command and is not set yet.
    if (std::find(commands.begin(), commands.end(), &command) == commands.end()) continue;
    CLI::Option* option = command.get_option_no_throw("--" + item.name);
    if (!option || is_set(*option)) continue;
    try {
      const std::vector<std::string> values = parse_values(item, *option);
      if (values.empty()) continue;
      for (const std::string& value : values) {
        if (value.empty())
          return make_config_error(file, item, "is empty - give a value, or leave it out");
        remember_name(value);
        option->add_result(value);
      }
      option->run_callback();
    } catch (const CLI::Error& error) {
      return make_config_error(file, item, error.what());
    }
  }
  return Ok{};
}

void prefer_command_line(const CLI::App& program) {
  CLI::App& command = *program.get_subcommands().front();
  for (CLI::Option* option : command.get_options())
    if (option->count() > 0 && !option->get_envname().empty()) option->run_callback();
}

}  // namespace polymorph
