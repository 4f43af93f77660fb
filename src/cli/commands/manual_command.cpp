#include "base/file.h"
#include "cli/command_line.h"
#include "options/option_table.h"
#include "scene/assignments.h"

namespace polymorph {
namespace {

/// Options of `manual` (`what`, `output`) and of `completion` (`shell`).
struct ManualOptions {
  std::string what, output, shell;
};

/// Makes the names of the commands the choices of every argument COMMAND, for completion.
void add_command_names(std::vector<CommandTable>& commands) {
  std::vector<std::string> names;
  for (const CommandTable& command : commands) names.push_back(command.name);
  for (CommandTable& command : commands)
    for (OptionRow& row : command.options)
      if (row.value == "COMMAND") row.choices = names;
}

Result<int> run_completion(const CommandLine& line, const ManualOptions& options) {
  std::vector<CommandTable> commands = command_tables(line);
  add_command_names(commands);
  print_bytes(options.shell == "bash"  ? bash_completion(commands)
              : options.shell == "zsh" ? zsh_completion(commands)
                                       : fish_completion(commands));
  return 0;
}

Result<int> run_manual(const CommandLine& line, const ManualOptions& options) {
  const std::vector<CommandTable> commands = command_tables(line);
  if (options.what != "man") {
    if (!options.output.empty())
      return make_error(ErrorCode::kUsage, "-o belongs to manual man; the rest is printed");
    print_bytes(options.what == "commands" ? commands_markdown(commands) : scene_markdown());
    return 0;
  }
  if (options.output.empty())
    return make_error(ErrorCode::kUsage, "manual man needs a folder - give -o man1");
  const std::filesystem::path folder(options.output);
  std::vector<NewFile> pages{{folder / "polymorph.1", program_page(commands)}};
  for (const CommandTable& command : commands)
    pages.push_back({folder / ("polymorph-" + command.name + ".1"), command_page(command)});
  for (const NewFile& page : pages) PM_TRY_STATUS(check_output(page.path, line.common.overwrite));
  PM_TRY_STATUS(write_files(pages));
  return 0;
}

}  // namespace

void add_completion(CommandLine& line) {
  auto options = std::make_shared<ManualOptions>();
  Command command =
      add_command(line, "completion", "Print a script that completes the command line in a shell.",
                  "  polymorph completion bash > /etc/bash_completion.d/polymorph\n"
                  "  polymorph completion fish > ~/.config/fish/completions/polymorph.fish",
                  "  0 printed   2 usage");
  command.add_option("shell", options->shell, "SHELL", "bash, zsh or fish")
      .required()
      .choices({"bash", "zsh", "fish"});
  set_action(line, command, [&line, options] { return run_completion(line, *options); });
}

void add_manual(CommandLine& line) {
  auto options = std::make_shared<ManualOptions>();
  Command command =
      add_command(line, "manual", "Print the reference, or write the manual pages.",
                  "  polymorph manual commands > docs/commands.md\n"
                  "  polymorph manual scene > docs/scene.md\n  polymorph manual man -o man1",
                  "  0 made   2 usage   4 cannot write, exists");
  command
      .add_option("what", options->what, "WHAT",
                  "commands or scene: Markdown, to standard output; man: pages in roff")
      .required()
      .choices({"commands", "scene", "man"});
  command.add_option("-o,--output", options->output, "DIR", "man: the folder for the pages");
  add_overwrite(command, line.common);
  set_action(line, command, [&line, options] { return run_manual(line, *options); });
}

void add_schema(CommandLine& line) {
  auto keys = std::make_shared<bool>(false);
  Command command = add_command(line, "schema", "Print the JSON Schema of scene files.",
                                "  polymorph schema > scene.schema.json\n  polymorph schema --keys",
                                "  0 printed");
  command.add_flag("--keys", *keys,
                   "print what --set takes instead: KEY=, or KEY=VALUE where values are words");
  set_action(line, command, [keys]() -> Result<int> {
    if (*keys)
      for (const std::string& assignment : list_assignments()) print_data("{}\n", assignment);
    else
      PM_TRY_STATUS(write_text(/*json=*/{}, scene_schema()));  // to standard output
    return 0;
  });
}

}  // namespace polymorph
