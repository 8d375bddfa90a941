// For tests/python/test_files.py: lets other programs' readers and writers meet ours.
//   files_probe write-safetensors FILE       a small store with every type
//   files_probe copy-safetensors FROM TO     read strictly (checksum if present), write again
//   files_probe write-events FOLDER          10 steps, then a resume from step 5 with other values
#include <array>
#include <cstdio>
#include <cstring>
#include <string>

#include "agail/base/atomic_file.h"
#include "agail/train/safetensors.h"
#include "agail/train/tensorboard.h"

namespace agail {
namespace {

void write_safetensors(const std::string& path) {
  std::vector<float> weights = {0.5F, -1.0F, 3.25F, 1e-30F, 7.0F, 8.0F};
  std::vector<std::int64_t> steps = {-1, 1LL << 40};
  double scale = 0.1;
  TensorStore store;
  Archive archive(store, Archive::Mode::kSave);
  archive("weights", weights);
  archive("steps", steps);
  archive("scale", scale);
  store.tensors["weights"].shape = {2, 3};
  store.tensors["flags"] = {DType::kU8, {3}, {1, 0, 1}};
  store.metadata = {{"environment", "Hopper-v4"}, {"note", "ä"}};
  write_file_atomically(path, to_safetensors(store));
}

void write_events(const std::string& folder) {
  using Point = std::pair<std::string_view, double>;
  const auto write = [](TensorBoardWriter& writer, int from, int to, double offset) {
    for (int step = from; step <= to; ++step)
      writer.scalars(step, std::array{Point{"rollout/ep_rew_mean", step + offset},
                                      Point{"train/kl", 0.01 * step}});
    writer.flush();
  };
  TensorBoardWriter first(folder);
  write(first, 1, 10, 0);
  TensorBoardWriter resumed(folder, 5);
  write(resumed, 6, 8, 100);
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() == 2 && arguments[0] == "write-safetensors") {
    write_safetensors(arguments[1]);
  } else if (arguments.size() == 3 && arguments[0] == "copy-safetensors") {
    const TensorStore store =
        from_safetensors(read_file(arguments[1]), arguments[1], Checksum::kIfPresent);
    write_file_atomically(arguments[2], to_safetensors(store));
  } else if (arguments.size() == 2 && arguments[0] == "write-events") {
    write_events(arguments[1]);
  } else {
    return 64;
  }
  return 0;
}

}  // namespace
}  // namespace agail

int main(int argc, char** argv) {
  try {
    return agail::run({argv + 1, argv + argc});
  } catch (const agail::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
