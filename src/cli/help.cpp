// Help as people read it: usage, what it does, examples, options in groups, exit codes; 80 columns.
#include <algorithm>

#include "cli/command_line.h"

namespace polymorph {
namespace {

constexpr std::size_t kWidth = 80;
constexpr std::size_t kColumn = 26;  // where descriptions start

/// Text wrapped at kWidth; the first line starts at `at`, the others at kColumn.
std::string wrapped(const std::string& text, std::size_t at) {
  std::string out;
  std::size_t column = at;
  bool fresh = true;
  for (std::size_t i = 0; i < text.size();) {
    std::size_t end = text.find(' ', i);
    if (end == std::string::npos) end = text.size();
    const std::string word = text.substr(i, end - i);
    if (!fresh && column + 1 + word.size() > kWidth) {
      out += "\n" + std::string(kColumn, ' ');
      column = kColumn;
      fresh = true;
    }
    if (!fresh) out += ' ', ++column;
    out += word;
    column += word.size();
    fresh = false;
    i = end + 1;
  }
  return out + "\n";
}

std::string row(const std::string& left, const std::string& right) {
  std::string out = "  " + left;
  if (out.size() + 2 > kColumn)
    out += "\n" + std::string(kColumn, ' ');
  else
    out.resize(kColumn, ' ');
  return out + wrapped(right, kColumn);
}

/// Without what CLI11's validators add ("N:INT in [1 - 1000]"): descriptions and messages tell the
/// range.
std::string type_name(const CLI::Option& option) {
  const std::string whole = option.get_type_name();
  return whole.substr(0, whole.find(':'));
}

std::string positional_name(const CLI::Option& option) {
  return option.get_type_name().empty() ? option.get_name(true) : type_name(option);
}

std::string option_names(const CLI::Option& option) {
  std::string names;
  if (option.get_positional() && option.get_snames().empty() && option.get_lnames().empty())
    return positional_name(option);
  for (const std::string& name : option.get_snames()) names += (names.empty() ? "-" : ", -") + name;
  for (const std::string& name : option.get_lnames()) {
    if (names.empty()) names = "    ";
    names += (names == "    " ? "--" : ", --") + name;
  }
  if (option.get_items_expected_max() > 0 && !option.get_type_name().empty())
    names += " " + type_name(option);
  return names;
}

std::string options_text(const CLI::App& app, bool full) {
  std::vector<std::string> groups;
  for (const CLI::Option* option : app.get_options()) {
    const std::string& group = option->get_group();
    if (!group.empty() && std::find(groups.begin(), groups.end(), group) == groups.end())
      groups.push_back(group);
  }
  // What every command shares comes last.
  std::stable_partition(groups.begin(), groups.end(),
                        [](const std::string& group) { return group != "Common"; });
  std::string out;
  for (const std::string& group : groups) {
    if (!full && group != groups.front()) continue;
    out += "\n" + group + ":\n";
    for (const CLI::Option* option : app.get_options())
      if (option->get_group() == group)
        out += row(option_names(*option), option->get_description());
  }
  return out;
}

std::string usage_of(const CLI::App& app) {
  std::string usage =
      app.get_parent() ? app.get_parent()->get_name() + " " + app.get_name() : app.get_name();
  if (!app.get_subcommands([](const CLI::App*) { return true; }).empty()) usage += " COMMAND";
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    const std::string name = positional_name(*option);
    usage += option->get_required() ? " " + name : " [" + name + "]";
  }
  return usage + " [OPTIONS]";
}

}  // namespace

std::string first_steps(const CommandLine& line) {
  const auto step = [&](const char* arguments, const char* what) {
    return fmt::format("  {} {}\n      {}\n", line.program, arguments, what);
  };
  return line.app.get_description() + "\n\nStart here:\n" +
         step("demo", "a teapot becomes a penguin: a strip, a GIF and the scene, in seconds") +
         step("demo monkey spider --through puddle", "any of the models that come with it") +
         step("init first.obj second.obj", "a scene for your own models, to edit and render") +
         fmt::format("\n{} --help lists all commands.\n", line.program);
}

std::string help_text(const CLI::App& app, bool full) {
  std::string out = app.get_description() + "\n\nUsage: " + usage_of(app) + "\n";
  // The footer holds "examples\fexit codes"; add_command() put it together.
  const std::string footer = app.get_footer();
  const auto cut = footer.find('\f');
  const std::string examples = footer.substr(0, cut);
  if (!examples.empty()) out += "\n" + examples + "\n";
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  if (!commands.empty()) {
    out += "\nCommands:\n";
    for (const CLI::App* command : commands)
      out += row(command->get_name(), command->get_description());
  }
  out += options_text(app, full || !commands.empty());
  if (full && cut != std::string::npos) out += "\n" + footer.substr(cut + 1) + "\n";
  if (!full && commands.empty()) out += "\n--help shows all options and the exit codes.\n";
  return out;
}

}  // namespace polymorph
