#include <cmath>
#include <limits>

#include "base/json.h"
#include "base/log.h"
#include "base/plural.h"
#include "base/text.h"
#include "cli/command_line.h"
#include "options/amounts.h"
#include "spheres/cache.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

struct CacheOptions {
  std::string max_size, max_age;
  JsonOutput json;
};

std::string format_age(double seconds) {
  const auto rounded_down = [](double value) { return static_cast<long long>(std::floor(value)); };
  if (seconds < 120) return fmt::format("{} s", rounded_down(seconds));
  if (seconds < 2 * 3600) return fmt::format("{} min", rounded_down(seconds / 60));
  if (seconds < 2 * 86400) return fmt::format("{} h", rounded_down(seconds / 3600));
  return fmt::format("{} days", rounded_down(seconds / 86400));
}

std::string format_files(std::size_t count, std::uint64_t bytes) {
  return fmt::format("{}, {}", plural(count, "file"), format_bytes(static_cast<double>(bytes)));
}

Result<fs::path> find_cache(const CommandLine& line) {
  fs::path folder = cache_folder(line.common);
  if (folder.empty())
    return make_error(ErrorCode::kUsage,
                      "there is no cache folder - give --cache-dir or set POLYMORPH_CACHE_DIR");
  return folder;
}

/// Lists the files of the cache. `is_verification`: reads all of them and reports which are bad.
Result<int> list_entries(const CommandLine& line, const CacheOptions& options,
                         bool is_verification) {
  PM_TRY(const fs::path folder, find_cache(line));
  const std::vector<CacheEntry> entries =
      is_verification ? verify_cache(folder) : list_cache(folder);
  JsonValue json{{"folder", folder.string()}};
  json["entries"] = JsonValue::array();
  std::uint64_t bytes = 0;
  std::size_t invalid = 0;
  for (const CacheEntry& entry : entries) {
    bytes += entry.bytes;
    invalid += entry.problem.empty() ? 0 : 1;
    JsonValue record{{"key", entry.key},
                     {"kind", entry.kind->name},
                     {"origin", entry.origin},
                     {"bytes", entry.bytes},
                     {"age_seconds", entry.age}};
    if (is_verification) {
      record["ok"] = entry.problem.empty();
      if (entry.spheres > 0) {
        record["spheres"] = entry.spheres;
        record["balls"] = entry.balls;
      }
      if (!entry.problem.empty()) record["problem"] = entry.problem;
    }
    json["entries"].push_back(record);
    if (options.json.enabled) continue;
    if (!entry.problem.empty())
      print_data("{}: {}\n", entry.file.filename().string(), entry.problem);
    else if (is_verification && entry.balls + entry.spheres > 0)
      print_data("{}: ok, {} spheres, {} balls\n", entry.file.filename().string(), entry.spheres,
                 entry.balls);
    else if (is_verification)
      print_data("{}: ok\n", entry.file.filename().string());
    else
      print_data("{}  {:<9}  {:>9}  {:>8}  {}\n", entry.key, entry.kind->name,
                 format_bytes(static_cast<double>(entry.bytes)), format_age(entry.age),
                 entry.origin);
  }
  json["bytes"] = bytes;
  if (options.json.enabled) {
    if (is_verification) json["ok"] = invalid == 0;
    PM_TRY_STATUS(write_json(options.json, json));
  } else {
    print_data("{}: {}{}\n", folder.string(), format_files(entries.size(), bytes),
               invalid > 0
                   ? fmt::format(", {} bad - 'polymorph cache clear' removes all files", invalid)
                   : "");
  }
  return invalid > 0 ? static_cast<int>(ErrorCode::kAnswerNo) : 0;
}

/// Prints what was removed, or writes it as JSON. Returns the exit code.
Result<int> report_cleaning(const fs::path& folder, const CacheCleaning& cleaning,
                            const CacheOptions& options) {
  for (const std::string& failure : cleaning.failures)
    log_message(LogLevel::kError, "cache: " + failure);
  if (options.json.enabled) {
    const JsonValue json{{"folder", folder.string()},
                         {"removed", cleaning.removed},
                         {"kept", cleaning.kept},
                         {"removed_bytes", cleaning.removed_bytes},
                         {"kept_bytes", cleaning.kept_bytes},
                         {"failures", cleaning.failures}};
    PM_TRY_STATUS(write_json(options.json, json));
  } else {
    print_data("{}: removed {}; kept {}\n", folder.string(),
               format_files(cleaning.removed, cleaning.removed_bytes),
               format_files(cleaning.kept, cleaning.kept_bytes));
  }
  return cleaning.failures.empty() ? 0 : static_cast<int>(ErrorCode::kOutput);
}

/// Removes the oldest files until the limits of size and age hold.
Result<int> collect_garbage(const CommandLine& line, const CacheOptions& options) {
  if (options.max_size.empty() && options.max_age.empty())
    return make_error(ErrorCode::kUsage,
                      "cache gc needs a limit - give --max-size 1G, --max-age 30d or both");
  PM_TRY(const fs::path folder, find_cache(line));
  double bytes = INFINITY, age = INFINITY;  // limits; age in seconds
  if (!options.max_size.empty()) {
    std::string size = options.max_size;
    if (const std::string problem = parse_size(size); !problem.empty())
      return make_error(ErrorCode::kUsage, "--max-size {}", problem);
    bytes = *parse_number(size);
  }
  if (!options.max_age.empty()) {
    PM_TRY(age, parse_amount("--max-age", options.max_age,
                             {{'d', 86400}, {'h', 3600}, {'m', 60}, {'s', 1}}, "30d or 12h"));
  }
  // Without --max-size `bytes` is infinite, beyond the range of the integer, which ends at 1.8e19.
  constexpr auto kMax = std::numeric_limits<std::uint64_t>::max();
  const std::uint64_t max_bytes = bytes < 1e19 ? static_cast<std::uint64_t>(bytes) : kMax;
  return report_cleaning(folder, trim_cache(folder, max_bytes, age), options);
}

Result<int> remove_entries(const CommandLine& line, const CacheOptions& options) {
  PM_TRY(const fs::path folder, find_cache(line));
  return report_cleaning(folder, clear_cache(folder), options);
}

}  // namespace

void add_cache(CommandLine& line) {
  auto options = std::make_shared<CacheOptions>();
  Command command =
      add_command(line, "cache",
                  "List, check or clean the cache of spheres, distances, colours, paces and plans.",
                  "  polymorph cache ls\n  polymorph cache verify\n"
                  "  polymorph cache gc --max-size 1G --max-age 30d\n  polymorph cache clear",
                  "  0 done   1 verify found a bad file   2 usage   4 a file cannot be removed");
  const std::vector<std::string> shared_options = {"--json", "--cache-dir"};
  add_verbs(
      line, command,
      {{"ls", "List the files of the cache: what each holds, its size and age.", "", "",
        shared_options, "  polymorph cache ls\n  polymorph cache ls --json | jq .bytes",
        "  0 listed   2 usage",
        [&line, options] { return list_entries(line, *options, /*is_verification=*/false); }},
       {"verify", "Read every file of the cache and say which are bad.", "", "", shared_options,
        "  polymorph cache verify", "  0 all are good   1 a file is bad   2 usage",
        [&line, options] { return list_entries(line, *options, /*is_verification=*/true); }},
       {"gc",
        "Remove the oldest files until the cache is within limits.",
        "",
        "",
        {"--max-size", "--max-age", "--json", "--cache-dir"},
        "  polymorph cache gc --max-size 1G --max-age 30d",
        "  0 done   2 usage   4 a file cannot be removed",
        [&line, options] { return collect_garbage(line, *options); }},
       {"clear", "Remove all files of the cache.", "", "", shared_options,
        "  polymorph cache clear", "  0 done   2 usage   4 a file cannot be removed",
        [&line, options] { return remove_entries(line, *options); }}});
  command.add_option("--max-size", options->max_size, "SIZE",
                     "keep at most this much: bytes, or with K, M, G or T (1024 each)");
  command.add_option("--max-age", options->max_age, "AGE", "keep nothing older, e.g. 30d");
  add_json(command, options->json);
}

}  // namespace polymorph
