#include "cli/option_table.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "base/text.h"

namespace polymorph {
namespace {

/// Of "WHEN:{auto,always,never}", which is what CLI11's validators make of a type's name.
std::vector<std::string> choices_of(const std::string& type) {
  const auto open = type.find('{'), close = type.rfind('}');
  if (open == std::string::npos || close == std::string::npos) return {};
  return split(type.substr(open + 1, close - open - 1), ',');
}

OptionRow row_of(const CLI::Option& option) {
  OptionRow row;
  for (const std::string& name : option.get_snames()) row.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) row.names.push_back("--" + name);
  const std::string type = option.get_type_name();
  if (option.get_items_expected_max() > 0) row.value = type.substr(0, type.find(':'));
  row.choices = choices_of(type);
  row.group = option.get_group();
  row.description = option.get_description();
  row.environment = option.get_envname();
  row.positional = option.get_positional();
  row.required = option.get_required();
  row.repeated = option.get_items_expected_max() > 1;
  return row;
}

}  // namespace

CommandTable command_table(const CLI::App& command) {
  CommandTable table;
  if (command.get_parent()) table.name = command.get_name();
  table.purpose = command.get_description();
  const std::string footer = command.get_footer();
  const auto cut = footer.find('\f');
  const auto body = [](const std::string& text) {
    const auto line = text.find('\n');
    return line == std::string::npos ? "" : text.substr(line + 1);
  };
  table.examples = body(footer.substr(0, cut));
  if (cut != std::string::npos) table.exit_codes = body(footer.substr(cut + 1));
  std::vector<std::string> groups;
  for (const CLI::Option* option : command.get_options()) {
    const std::string& group = option->get_group();
    if (group.empty()) continue;
    if (std::find(groups.begin(), groups.end(), group) == groups.end()) groups.push_back(group);
    if (option->get_positional()) table.options.push_back(row_of(*option));
  }
  // What every command shares comes last.
  std::stable_partition(groups.begin(), groups.end(),
                        [](const std::string& group) { return group != "Common"; });
  for (const std::string& group : groups)
    for (const CLI::Option* option : command.get_options())
      if (option->get_group() == group && !option->get_positional())
        table.options.push_back(row_of(*option));
  return table;
}

std::vector<CommandTable> command_tables(const CLI::App& app) {
  std::vector<CommandTable> tables;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    tables.push_back(command_table(*command));
  return tables;
}

}  // namespace polymorph
