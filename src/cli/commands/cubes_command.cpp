#include "base/json.h"
#include "cli/command_line.h"
#include "kernels/mc_tables.h"

namespace polymorph {
namespace {

/// Describes one of the 256 cases of marching cubes: its base case, inside corners and triangles,
/// each as three edges. `key` is the sum of the inside corners' weights.
JsonValue cube_json(int key) {
  JsonValue inside = JsonValue::array(), triangles = JsonValue::array();
  for (int corner = 0; corner < 8; ++corner)
    if (key_has(key, corner)) inside.push_back(corner);
  const McTable& table = mc_table();
  for (int t = 0; t < table.count[key]; ++t)
    triangles.push_back(JsonValue::array(
        {table.edges[key][3 * t], table.edges[key][3 * t + 1], table.edges[key][3 * t + 2]}));
  return {{"key", key},
          {"base", mc::base_cases()[static_cast<std::size_t>(key)]},
          {"inside", std::move(inside)},
          {"triangles", std::move(triangles)}};
}

/// Describes the corners and edges of a cell, so that the table can be drawn without the source.
JsonValue layout_json() {
  JsonValue corners = JsonValue::array(), edges = JsonValue::array();
  for (int c = 0; c < 8; ++c)  // bit i of c is the corner's coordinate on axis i
    corners.push_back(
        {{"at", JsonValue::array({c & 1, c >> 1 & 1, c >> 2 & 1})}, {"weight", corner_weight(c)}});
  for (int e = 0; e < 12; ++e)
    edges.push_back(JsonValue::array({edge_low_corner(e), edge_high_corner(e)}));
  return {{"corners", std::move(corners)}, {"edges", std::move(edges)}};
}

/// Lists the keys that represent the base cases.
JsonValue base_keys_json() {
  JsonValue keys = JsonValue::array();
  for (int base = 0; base < mc::kBaseCaseCount; ++base) keys.push_back(mc::base_key(base));
  return keys;
}

/// Prints the case `chosen_key`, or all cases if it is negative.
Result<int> run_cubes(int chosen_key, const JsonOutput& json_output) {
  const int first = chosen_key >= 0 ? chosen_key : 0, last = chosen_key >= 0 ? chosen_key : 255;
  JsonValue json = layout_json();
  json["bases"] = base_keys_json();
  json["cubes"] = JsonValue::array();
  if (!json_output.enabled) print_data("key  base  inside           triangles, as edges\n");
  for (int key = first; key <= last; ++key) {
    JsonValue cube = cube_json(key);
    if (!json_output.enabled)
      print_data("{:>3}  {:>4}  {:<15}  {}\n", key, cube.get("base").integer,
                 format_json(cube.get("inside")), format_json(cube.get("triangles")));
    json["cubes"].push_back(std::move(cube));
  }
  if (json_output.enabled) PM_TRY_STATUS(write_text(json_output, dump_json(json, /*indent=*/-1)));
  return 0;
}

}  // namespace

void add_cubes(CommandLine& line) {
  struct Options {
    int key = -1;  ///< below 0: all cases
    JsonOutput json;
  };
  auto options = std::make_shared<Options>();
  Command command = add_command(line, "cubes", "Print the table of marching cubes.",
                                "  polymorph cubes 240\n  polymorph cubes --json", "  0 printed");
  command
      .add_option("key", options->key, "KEY",
                  "only this one of the 256: the sum of its inside corners' weights")
      .range(0, 255);
  add_json(command, options->json);
  set_action(line, command, [options] { return run_cubes(options->key, options->json); });
}

}  // namespace polymorph
