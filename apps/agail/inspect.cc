// agail inspect: a demonstration file, a policy or a run, in words.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/demos/minari_reader.h"
#include "agail/demos/spaces_json.h"
#include "agail/train/saved_policy.h"
#include "commands.h"
#include "inspect_demos.h"

namespace agail {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

ordered_json describe_policy(const SavedPolicy& policy) {
  const PolicyInfo& info = policy.info();
  ordered_json result = {{"kind", "policy"},
                         {"environment", info.environment},
                         {"method", info.method},
                         {"timesteps", info.timesteps},
                         {"observation_dim", policy.observation_dim()},
                         {"action_space", policy.action().discrete ? "Discrete" : "Box"},
                         {"action_dim", policy.action().encoded_dim()},
                         {"hidden", policy.hidden()},
                         {"parameters", policy.network().parameters()}};
  if (info.demonstrations_mean_return)
    result["demonstrations_mean_return"] = *info.demonstrations_mean_return;
  return result;
}

ordered_json read_summary(const fs::path& file) {
  const std::vector<std::uint8_t> bytes = read_file(file);
  ordered_json summary;
  try {
    summary =
        parse_python_json<ordered_json>(std::string(bytes.begin(), bytes.end()), file.string());
  } catch (const InputError&) {  // null is no object either
  }
  if (!summary.is_object())
    throw InputError(file.string() +
                     " is damaged; remove it, and agail train ... --resume writes it again");
  return summary;
}

ordered_json describe_run(const fs::path& folder) {
  const fs::path file = folder / "summary.json";
  ordered_json result = {{"kind", "run"}};
  if (!is_there(file)) {
    result["finished"] = false;
    result["note"] =
        "no summary.json: the run is under way, or was cut off; agail train ... --resume goes on "
        "with it";
    return result;
  }
  result.update(read_summary(file));
  return result;
}

void print(const ordered_json& description, int indent = 0) {
  for (const auto& [key, value] : description.items()) {
    std::printf("%*s%-*s ", indent, "", 28 - indent, key.c_str());
    if (value.is_object()) {
      std::printf("\n");
      print(value, indent + 2);
    } else {
      std::printf("%s\n",
                  value.is_string() ? value.get<std::string>().c_str() : value.dump().c_str());
    }
  }
}

void run(const std::string& path, bool json) {
  const bool is_run = is_there(fs::path(path) / "config.toml");
  const bool is_policy = fs::path(path).extension() == ".safetensors";
  if (!is_run && !is_policy) {
    describe_demonstrations(read_demonstrations(path), json, std::cout);
    return;
  }
  const ordered_json description =
      is_run ? describe_run(path) : describe_policy(SavedPolicy::load(path));
  if (json)
    std::cout << description.dump(2) << "\n";
  else
    print(description);
}

}  // namespace

void add_inspect(CLI::App& app) {
  CLI::App* command = app.add_subcommand("inspect", "Describe demonstrations, a policy or a run");
  const auto path = std::make_shared<std::string>();
  const auto json = std::make_shared<bool>(false);
  command
      ->add_option(
          "PATH", *path,
          "Demonstrations (file, folder, Minari id), a .safetensors policy or a run folder")
      ->required();
  command->add_flag("--json", *json, "Print JSON");
  command->callback([path, json] { run(*path, *json); });
}

}  // namespace agail
