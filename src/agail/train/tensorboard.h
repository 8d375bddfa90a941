// Scalars for TensorBoard: an event file (TFRecord framing around Event protocol buffers).
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace agail {

class TensorBoardWriter {
 public:
  // Starts a new event file in `folder` (which exists), sorted behind those that are there. After a
  // resume, `resume_step` is the checkpoint's step: TensorBoard then drops what earlier files hold
  // of later steps. SystemError if the file cannot be written, here and below.
  explicit TensorBoardWriter(const std::filesystem::path& folder,
                             std::optional<std::int64_t> resume_step = std::nullopt);

  // One point for each tag, in single precision as TensorBoard keeps them; NaN means absent.
  void scalars(std::int64_t step, std::span<const std::pair<std::string_view, double>> values);
  void flush();

  const std::filesystem::path& path() const { return path_; }

 private:
  void write_event(const std::string& fields);
  void write(std::string_view bytes);

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::filesystem::path path_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace agail
